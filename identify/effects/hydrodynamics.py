"""Forces of the water on a moving hull that a diagonal, linear damping leaves out."""

import numpy as np

from bridge.arrays import Array
from identify.effects.course import Course
from identify.effects.effect import Act, Compensation, Effect, Parameter, Separation, compensated_by_name

DRAG_UNITS = ("N s2/m2",) * 3 + ("N m s2/rad2",) * 3


def _drag(course: Course, values: Array) -> Act:
    """Fossen 2011, section 6.4; the values are the magnitudes of X_u|u| and so on."""
    return Act(wrench=-values * np.abs(course.nu) * course.nu, quadratic=values)


DRAGS = tuple(
    Parameter(name, unit, start, low=0.0)
    for name, unit, start in zip(
        ("X_uu", "Y_vv", "Z_ww", "K_pp", "M_qq", "N_rr"),
        DRAG_UNITS,
        (10.0, 10.0, 10.0, 1.0, 1.0, 1.0),
        strict=True,
    )
)
QUADRATIC_DRAG = Effect(
    "quadratic_drag",
    "drag that grows with the square of the speed",
    "force",
    DRAGS,
    _drag,
    Separation(manoeuvres=("three steady speeds and a coast-down",)),
    growth_is_apart=True,
    feedforward="quadratic_drag",
    model_part="quadratic",
    compensation=compensated_by_name(*DRAGS),
)


def _coupled(course: Course, values: Array) -> Act:
    wrench = np.zeros_like(course.nu)
    wrench[:, 1] = -values[0] * course.nu[:, 5]
    wrench[:, 5] = -values[1] * course.drifting[:, 1]
    return Act(wrench=wrench)


COUPLINGS = (Parameter("Y_r", "N s/rad", 1.0), Parameter("N_v", "N s", 1.0))
COUPLED_DAMPING = Effect(
    "coupled_damping",
    "damping that couples sway and yaw: a hull that is not the same fore and aft",
    "force",
    COUPLINGS,
    _coupled,
    Separation(manoeuvres=("a spin in place, and legs in sway",)),
    feedforward="coupling",
    compensation=compensated_by_name(*COUPLINGS),
)


def _lift(course: Course, values: Array) -> Act:
    wrench = np.zeros_like(course.nu)
    pushed, turned = (np.abs(u) * v for u, v, *_ in (course.nu.T, course.drifting.T))
    wrench[:, 1], wrench[:, 5] = -values[0] * pushed, -values[1] * turned
    return Act(wrench=wrench)


LIFTS = (Parameter("Y_uv", "N s2/m2", 5.0), Parameter("N_uv", "N s2/m", 5.0))
CROSS_FLOW_LIFT = Effect(
    "cross_flow_lift",
    "lift of the hull as it drifts sideways while it goes ahead",
    "force",
    LIFTS,
    _lift,
    Separation(manoeuvres=("legs at a constant drift angle",)),
    feedforward="coupling",
    compensation=compensated_by_name(*LIFTS),
)


def _munk(course: Course, values: Array) -> Act:
    """A share of the Munk moments -(M_j - M_i) nu_i nu_j is missing or in excess (Fossen 2011, section 6.3)."""
    u, v, w = course.drifting.T
    m_u, m_v, m_w = course.mass[:3].tolist()
    wrench = np.zeros_like(course.nu)
    wrench[:, 3] = (m_w - m_v) * v * w
    wrench[:, 4] = (m_u - m_w) * u * w
    wrench[:, 5] = (m_v - m_u) * u * v
    wrench *= -(values[0] - 1.0)
    return Act(wrench=wrench)


def _munk_in_yaw(course: Course, values: Array) -> Act:
    wrench = np.zeros_like(course.nu)
    arm = float(course.mass[1] - course.mass[0])
    wrench[:, 5] = -(values[0] - 1.0) * arm * course.drifting[:, 0] * course.drifting[:, 1]
    return Act(wrench=wrench)


MUNK_MOMENT, MUNK_MOMENT_IN_YAW = (
    Effect(
        "munk_moment",
        "a Munk moment other than the masses make it",
        "force",
        (Parameter("gain", "1", 1.3, none=1.0),),
        act,
        Separation(manoeuvres=("surge and sway at once",)),
        feedforward="coupling",
        variant=variant,
        compensation=lambda course: (
            Compensation("N_munk", "kg", "gain", float(course.mass[1] - course.mass[0]), none=1.0),
        ),
        caveat=caveat,
    )
    for act, variant, caveat in (
        (
            _munk,
            "all three",
            "Munk moment: the feed-forward makes up for it in yaw, the PID in roll and pitch.",
        ),
        (_munk_in_yaw, "yaw alone", ""),
    )
)


def _astern(course: Course, values: Array) -> Act:
    wrench = np.zeros_like(course.nu)
    astern = np.minimum(course.nu, 0.0)
    wrench[:, 0] = -(values[0] - 1.0) * course.drag_of(astern)[:, 0]
    return Act(wrench=wrench)


DRAG_ASYMMETRY = Effect(
    "drag_asymmetry",
    "more drag astern than ahead: as many times more as the ratio says",
    "force",
    (Parameter("ratio", "1", 1.3, low=0.0, none=1.0),),
    _astern,
    Separation(manoeuvres=("a coast-down astern",)),
)


def _growing(course: Course, values: Array) -> Act:
    """D(t) = D (1 + rate t)."""
    return Act(wrench=-(values[0] * course.since_s)[:, None] * course.drag_of(course.nu))


FOULING = Effect(
    "fouling",
    "drag that grows with time, as of weed that gathers",
    "force",
    (Parameter("rate", "1/s", 5e-4, low=0.0),),
    _growing,
    Separation(
        manoeuvres=("a coast-down at the beginning and at the end",),
        sensors=("the battery's voltage and shaft speeds",),
    ),
    variant="over the dive",
)


def _grown(course: Course, values: Array) -> Act:
    quadratic = values[0] * course.quadratic
    drag = -quadratic * np.abs(course.nu) * course.nu
    return Act(wrench=drag, quadratic=quadratic, damping=values[0] * course.damping)


FOULING_SINCE = Effect(
    "fouling",
    "more drag in all degrees of freedom than when the parameters were accepted",
    "force",
    (Parameter("share", "1", 0.2, low=-1.0),),
    _grown,
    Separation(manoeuvres=("the parameters that were accepted before",)),
    feedforward="nominal",
    variant="since the last time",
    refit_absorbs=True,
    # A single dive does not show how long the growth took, so there is no rate to report.
    telling=lambda _: {},
    less="less drag in all degrees of freedom than when the parameters were accepted, as of a hull that was cleaned",
)

EFFECTS = (
    QUADRATIC_DRAG, COUPLED_DAMPING, CROSS_FLOW_LIFT, MUNK_MOMENT, MUNK_MOMENT_IN_YAW, DRAG_ASYMMETRY, FOULING,
    FOULING_SINCE,
)  # fmt: skip
