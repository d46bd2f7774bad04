"""Differences between the actual body and the vehicle file: mass, balance, buoyancy."""

import numpy as np

from bridge.arrays import Array
from bridge.vehicle.config import GRAVITY_M_S2
from identify.effects.course import Course
from identify.effects.effect import Act, Compensation, Effect, Parameter, Separation


def moments_of_mass(course: Course, first: Array) -> Array:
    """Wrench (n, 6) of first moments of mass m (x, y, z), kg m, about the origin, in addition to that of a balanced
    body.

    m (d(v)/dt + omega x v + d(omega)/dt x c + omega x (omega x c)) and c x m (d(v)/dt + omega x v), moved to the
    other side of the equation (Fossen 2011, eqs 3.57 and 3.60). The weight of the off-centre mass is not included.
    """
    (u, v, w, p, q, r), (du, dv, dw, dp, dq, dr) = course.nu.T, course.nu_dot.T
    x, y, z = first.tolist()
    ahead, aside, down = du + w * q - v * r, dv + u * r - w * p, dw + v * p - u * q
    return -np.column_stack(
        [
            -x * (q**2 + r**2) + y * (p * q - dr) + z * (p * r + dq),
            -y * (r**2 + p**2) + z * (q * r - dp) + x * (p * q + dr),
            -z * (p**2 + q**2) + x * (r * p - dq) + y * (r * q + dp),
            y * down - z * aside,
            z * ahead - x * down,
            x * aside - y * ahead,
        ]
    )


def _in_space(course: Course, values: Array) -> Act:
    mass = course.configuration.dry_mass_kg
    return Act(wrench=moments_of_mass(course, mass * np.array([values[0], values[1], 0.0])))


def _level(course: Course, values: Array) -> Act:
    """Surge, sway and yaw only: an added mass that couples sway and yaw acts in the same way, M23 = m x - Y_rdot."""
    x, y = (course.configuration.dry_mass_kg * values).tolist()
    (u, v, _, _, _, r), (du, dv, _, _, _, dr) = course.nu.T, course.nu_dot.T
    wrench = np.zeros_like(course.nu)
    wrench[:, 0] = y * dr + x * r**2
    wrench[:, 1] = -x * dr + y * r**2
    wrench[:, 5] = -x * (dv + u * r) + y * (du - v * r)
    return Act(wrench=wrench)


def _first_moments(course: Course) -> tuple[Compensation, ...]:
    mass_kg = course.configuration.dry_mass_kg
    return tuple(Compensation(f"S_{axis}", "kg m", axis, mass_kg) for axis in ("x", "y"))


CG_OFFSET, CG_OFFSET_IN_SPACE = (
    Effect(
        "cg_offset",
        "a centre of mass that is off the origin ahead or aside, or added mass that couples sway and yaw",
        "body",
        (Parameter("x", "m", 0.01, -2.0, 2.0), Parameter("y", "m", 0.01, -2.0, 2.0)),
        act,
        Separation(
            manoeuvres=(
                "only its sum with the added mass is told, over the dry mass",
                "static trim, or weighing both ends, splits them",
            )
        ),
        feedforward="coupling",
        variant=variant,
        compensation=_first_moments,
    )
    for act, variant in ((_level, "surge, sway and yaw"), (_in_space, "all degrees of freedom"))
)


def _righting(course: Course, height_m: float) -> Array:
    down = course.world[2]
    weight = course.configuration.dry_mass_kg * GRAVITY_M_S2
    wrench = np.zeros_like(course.nu)
    wrench[:, 3], wrench[:, 4] = -height_m * weight * down[:, 1], height_m * weight * down[:, 0]
    return wrench


def _low(course: Course, values: Array) -> Act:
    """A centre of mass `height` lower than assumed: its righting moment, and its inertia about the origin."""
    first = np.array([0.0, 0.0, course.configuration.dry_mass_kg * values[0]])
    return Act(wrench=_righting(course, float(values[0])) + moments_of_mass(course, first))


def _thrust_line(course: Course, values: Array) -> Act:
    """Thrust that acts `height` lower than assumed: K = -z Y, M = z X of the thrusters."""
    thrust = course.wrench_of(course.thrust_n)
    wrench = np.zeros_like(course.nu)
    wrench[:, 3], wrench[:, 4] = -values[0] * thrust[:, 1], values[0] * thrust[:, 0]
    return Act(wrench=wrench)


def _carried_lower(course: Course, height_m: float) -> Array:
    """Wrench (n, 6) of added mass whose centre lies `height_m` lower: X_qdot = M_udot and Y_pdot = K_vdot, and the
    Coriolis forces of these (Fossen 2011, eqs 6.40 and 6.43)."""
    along, across = (height_m * course.added_mass[:2]).tolist()
    (u, v, w, p, q, r), (du, dv, _, dp, dq, _) = course.nu.T, course.nu_dot.T
    ahead, aside, roll, pitch = along * q, -across * p, -across * v, along * u
    return -np.column_stack(
        [
            along * dq - r * aside,
            -across * dp + r * ahead,
            p * aside - q * ahead,
            -across * dv - r * pitch - w * aside,
            along * du + r * roll + w * ahead,
            p * pitch - q * roll + u * aside - v * ahead,
        ]
    )


def _hull_forces(course: Course, values: Array) -> Act:
    """Added mass and drag whose centre lies `height` lower."""
    drag = course.drag_of(course.nu)
    moments = np.zeros_like(course.nu)
    moments[:, 3], moments[:, 4] = values[0] * drag[:, 1], -values[0] * drag[:, 0]
    return Act(wrench=moments + _carried_lower(course, float(values[0])))


PITCH_ROLL_COUPLING = tuple(
    Effect(
        "pitch_roll_coupling",
        sentence,
        "body",
        (Parameter("height", "m", 0.01, -0.5, 0.5),),
        act,
        Separation(manoeuvres=("a pitch step, and a weight that tilts it at rest",)),
        needs=("attitude",),
        variant=variant,
        in_file=in_file,
    )
    for sentence, act, variant, in_file in (
        (
            "righting moments other than the vehicle file's: the centre of mass lies lower below that of buoyancy",
            lambda course, values: Act(wrench=_righting(course, float(values[0]))),
            "righting",
            lambda configuration: configuration.centre_of_gravity_below_buoyancy_m,
        ),
        (
            "a centre of mass that lies lower: it rights, and pitches with surge and rolls with sway",
            _low,
            "mass",
            None,
        ),
        (
            "thrusters that push lower than the vehicle file says: pitch with surge thrust",
            _thrust_line,
            "thrust line",
            None,
        ),
        (
            "added mass and drag whose centre lies lower than the centre of mass, or higher below zero: pitch with "
            "surge, roll with sway",
            _hull_forces,
            "hull's forces",
            None,
        ),
        (
            "added mass whose centre lies lower than the centre of mass, or higher below zero: pitch with surge, roll "
            "with sway",
            lambda course, values: Act(wrench=_carried_lower(course, float(values[0]))),
            "added mass",
            None,
        ),
    )
)


def _buoyancy(course: Course, values: Array) -> Act:
    """A value above 0 acts upward, as in a vehicle file."""
    wrench = np.zeros_like(course.nu)
    wrench[:, :3] = -values[0] * course.world[2]
    return Act(wrench=wrench)


NET_BUOYANCY = Effect(
    "net_buoyancy",
    "a buoyancy other than the vehicle file says, as of fresh or salt water",
    "body",
    (Parameter("force", "N", 0.5),),
    _buoyancy,
    Separation(manoeuvres=("a drift without thrust", "at depth again")),
    model_part="net_buoyancy_n",
    sudden=True,
    in_file=lambda configuration: configuration.net_buoyancy_n,
)


def _bias(course: Course, values: Array) -> Act:
    wrench = np.zeros_like(course.nu)
    wrench[:, [0, 1, 2, 5]] = values
    return Act(wrench=wrench)


THRUST_BIAS = Effect(
    "thrust_bias",
    "a constant force on the body that no speed explains",
    "force",
    tuple(Parameter(n, u, 0.5) for n, u in zip("XYZN", ("N", "N", "N", "N m"), strict=True)),
    _bias,
    Separation(manoeuvres=("a minute at rest, and opposite headings",)),
)


def _more_mass(mass_kg: float) -> Array:
    """Equal in surge, sway and heave: the change of the inertias depends on its position, which one number does not
    give."""
    return np.array([mass_kg] * 3 + [0.0] * 3)


ENTRAINED_WATER = Effect(
    "entrained_water",
    "water that the hull carries along: as much more mass in surge, sway and heave",
    "body",
    (Parameter("mass", "kg", 2.0),),
    lambda _, values: Act(mass=_more_mass(float(values[0]))),
    Separation(manoeuvres=("the same more in all three", "weighing it wet")),
    feedforward="nominal",
    refit_absorbs=True,
    less="less water that the hull carries along than before: as much less mass in surge, sway and heave",
)


def _payload(course: Course, values: Array) -> Act:
    """More mass, and more drag along the axes in proportion to the dry mass; about the axes both depend on its
    position."""
    share = values[0] / course.configuration.dry_mass_kg * np.array([1.0, 1.0, 1.0, 0.0, 0.0, 0.0])
    quadratic = share * course.quadratic
    return Act(
        wrench=-quadratic * np.abs(course.nu) * course.nu,
        mass=_more_mass(float(values[0])),
        damping=share * course.damping,
        quadratic=quadratic,
    )


ADDED_PAYLOAD = Effect(
    "added_payload",
    "a payload that was not there before: more mass and more drag",
    "body",
    (Parameter("mass", "kg", 2.0),),
    _payload,
    Separation(manoeuvres=("the parameters that were accepted before",)),
    feedforward="nominal",
    refit_absorbs=True,
    less="a payload that was there before and is not now: less mass and less drag",
)

EFFECTS = (
    CG_OFFSET, CG_OFFSET_IN_SPACE, *PITCH_ROLL_COUPLING, NET_BUOYANCY, THRUST_BIAS, ENTRAINED_WATER, ADDED_PAYLOAD,
)  # fmt: skip
