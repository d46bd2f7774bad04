"""Moving water, a surface, bottom or wall nearby, a tether.

A neutrally buoyant vehicle moves through moving water as it does through water at rest (Fossen 2011, section 8.3;
accelerating water also pushes the volume that it surrounds, Newman 1977, section 4.13). A current is therefore no
force: it is the excess of the velocity over ground over that through the water.
"""

from collections.abc import Iterator, Sequence

import numpy as np

from bridge.arrays import Array
from bridge.vehicle.coefficients import HEAVE
from bridge.vehicle.config import GRAVITY_M_S2
from identify.effects.course import Course
from identify.effects.effect import Act, AnswerParameters, Effect, Parameter, Separation

WAVE_PERIODS_S = (2.0, 3.0, 4.0, 5.0, 6.5, 8.0)
CURRENT_PERIODS_S = (20.0, 40.0, 80.0, 160.0)


def _steady(course: Course, values: Array) -> Act:
    return Act(water=course.in_body(float(values[0]), float(values[1])))


STEADY_CURRENT = Effect(
    "steady_current",
    "a current that stays as it is",
    "water",
    (Parameter("north", "m/s", 0.05, -3.0, 3.0), Parameter("east", "m/s", 0.05, -3.0, 3.0)),
    _steady,
    Separation(
        manoeuvres=("one leg on three headings or more, or a slow full turn", "a drift without thrust")
    ),
    lasting=False,
    model_part="current_m_s",
)


def varying_current(*periods_s: float) -> Effect:
    """A sine and a cosine of each period in north and in east: four parameters per period. The answer gives the
    amplitude of all together and the period of their mean rate."""
    rates = [2 * np.pi / period_s for period_s in periods_s]

    def act(course: Course, values: Array) -> Act:
        water = np.zeros((2, len(course.since_s)))
        for rate, line in _present(rates, values.reshape(-1, 2, 2)):
            water += line @ np.stack([np.sin(rate * course.since_s), np.cos(rate * course.since_s)])
        return Act(water=course.in_body(*water))

    def telling(values: Array) -> AnswerParameters:
        lines = np.linalg.norm(values.reshape(-1, 4), axis=1)
        return {
            "amplitude": (float(np.linalg.norm(lines)), "m/s"),
            "period": (_usual_s(periods_s, lines**2), "s"),
        }

    return Effect(
        "varying_current",
        "a current that comes and goes with a period",
        "water",
        tuple(
            Parameter(f"{way}_{part}", "m/s", 0.03)
            for _ in periods_s
            for way in ("north", "east")
            for part in ("sin", "cos")
        ),
        act,
        Separation(manoeuvres=("the same leg again",)),
        variant=_variant(periods_s),
        telling=telling,
        sea=True,
        lasting=False,
    )


def waves(*periods_s: float) -> Effect:
    """A force of each period in north, east and down that decays with depth as exp(-k z), with k of deep water: six
    parameters per period. The answer gives the larger of its horizontal and its vertical amplitude, at the median
    depth of the dive, and the period of their mean rate."""
    rates = [2 * np.pi / period_s for period_s in periods_s]

    def act(course: Course, values: Array) -> Act:
        force, below_m = np.zeros((3, len(course.since_s))), course.below_m
        for rate, line in _present(rates, values.reshape(-1, 3, 2)):
            dying = np.exp(-(rate**2) / GRAVITY_M_S2 * below_m)
            force += dying * (line @ np.stack([np.sin(rate * course.since_s), np.cos(rate * course.since_s)]))
        wrench = np.zeros_like(course.nu)
        wrench[:, :3] = course.in_body(force[0], force[1]) + (course.world[2].T * force[2]).T
        return Act(wrench=wrench)

    def telling(values: Array) -> AnswerParameters:
        lines = values.reshape(-1, 6)
        usual_s = _usual_s(periods_s, (lines**2).sum(axis=1))
        return {"force_amplitude": (max(_amplitudes(values)), "N"), "period": (usual_s, "s")}

    def possible(course: Course, values: Array) -> bool:
        period_s, _ = telling(values)["period"]
        level_n, upright_n = _amplitudes(values)
        level_m_s2, upright_m_s2 = level_n / course.mass[:2].mean(), upright_n / course.mass[HEAVE]
        below = max(level_m_s2, upright_m_s2) <= steepest_m_s2(course, period_s)
        return bool(below and (not level_n or upright_m_s2 < MOST_UPRIGHT * level_m_s2))

    return Effect(
        "waves",
        "waves in a narrow band about one period",
        "water",
        tuple(
            Parameter(f"{way}_{part}", "N", 1.0)
            for _ in periods_s
            for way in ("north", "east", "down")
            for part in ("sin", "cos")
        ),
        act,
        Separation(manoeuvres=("the same run deeper",)),
        variant=_variant(periods_s),
        possible=possible,
        telling=telling,
        sea=True,
        lasting=False,
    )


STEEPEST = 0.446
"""Wave number times amplitude of the steepest wave of deep water, whose height is 0.142 of its length (Michell 1893): a
steeper one breaks."""

MOST_UPRIGHT = 4.0
"""Upright acceleration of the water over its level one, at most: the orbits of travelling waves are circles in deep
water and flatter in shallow. A force that is more upright is of another kind, as a pump's."""


def steepest_m_s2(course: Course, period_s: float) -> float:
    """Largest acceleration of the water by waves of one period at the median depth of a dive, where their orbits have
    faded, m/s2; no bound without a depth."""
    known = course.depth_m[np.isfinite(course.depth_m)]
    if not len(known):
        return np.inf
    number = (2 * np.pi / period_s) ** 2 / GRAVITY_M_S2
    return float(STEEPEST * GRAVITY_M_S2 * np.exp(-number * max(float(np.median(known)), 0.0)))


def _amplitudes(values: Array) -> tuple[float, float]:
    """Level and upright amplitude of all lines together, N."""
    lines = values.reshape(-1, 6)
    return float(np.linalg.norm(lines[:, :4])), float(np.linalg.norm(lines[:, 4:]))


def _present(rates: Sequence[float], lines: Array) -> Iterator[tuple[float, Array]]:
    """The nonzero lines, with their rates."""
    return ((rate, line) for rate, line in zip(rates, lines, strict=True) if line.any())


def _usual_s(periods_s: tuple[float, ...], power: Array) -> float:
    """The period of the mean rate, weighted by the lines' power."""
    rates = 1.0 / np.array(periods_s)
    return float(power.sum() / (power @ rates)) if power.any() else periods_s[0]


def _variant(periods_s: tuple[float, ...]) -> str:
    texts = [f"{period_s:.3g}" for period_s in periods_s]
    return f"{' and '.join(filter(None, (', '.join(texts[:-1]), texts[-1])))} s"


REFERENCE_M = 0.5
"""Distance from the boundary for which `mass_change` is reported."""

HALF_HEIGHT_M = 0.25
"""Half the height of a hull: its middle is never nearer to the boundary."""

SHARES = np.array([0.25, 1.0, 1.0, 0.0, 0.0, 0.0])
"""Share of the change in each degree of freedom: in surge none for a cylinder, half for a sphere (Lamb 1932, article
99); a hull lies between these."""

MOST = 2.0
"""The value for a cylinder of 1 m radius at `REFERENCE_M`: none of these vehicles is thicker."""

LEAST = -0.2
"""Waves may reduce added mass below a free surface, at most by all of it when the hull touches the surface."""


def _near(course: Course, values: Array, far_m: Array, away: Array) -> Act:
    """Added masses larger by `values[0]` at `REFERENCE_M`, falling with the distance squared: M_A (1 + a^2 / (2 h^2))
    for a cylinder near a wall (Lamb 1932, section 72). No contribution if the distance is unknown.

    The addition to M_A brings its own Coriolis force (Fossen 2011, eq. 6.43 and 6.44); otherwise it would produce a
    spurious Munk moment. Because it changes with the distance h, the water's energy exerts a force too: along `away`
    (n, 3), the direction in which h grows, dM_A/dh nu^2 / 2, less dM_A/dt nu (Lagrange's equations; Lamb 1932,
    section 137). The size of this force has a parameter of its own, `values[1]`, for two reasons. The power of the
    distance by which a hull's added masses fall is unknown (2 for a cylinder, 3 for a sphere). And if the distance
    hardly varies, a refit absorbs the change of the masses, but not this force.
    """
    added = SHARES * np.maximum(course.added_mass, 0.0)
    known, square = np.isfinite(far_m), np.maximum(far_m, 0.0) ** 2 + HALF_HEIGHT_M**2
    fall = np.where(known, (REFERENCE_M**2 + HALF_HEIGHT_M**2) / square, 0.0)
    wrench = -(values[0] * fall)[:, None] * (added * course.nu_dot + course.coriolis_of(added, course.nu))
    by_metre = np.where(known, -2.0 * values[1] * fall * np.maximum(far_m, 0.0) / square, 0.0)
    departing = np.einsum("ni,ni->n", away, course.nu[:, :3])
    wrench -= (by_metre * departing)[:, None] * added * course.nu
    wrench[:, :3] += (0.5 * by_metre * (course.nu**2 @ added))[:, None] * away
    return Act(wrench=wrench)


def _mass_change(values: Array) -> AnswerParameters:
    """The change of the masses from their inertia, or from their pull if the former is absent."""
    change = values[0] if values[0] != 0.0 else values[1]
    return {"mass_change": (float(change), "1")}


def _changes(least: float) -> tuple[Parameter, ...]:
    return tuple(Parameter(name, "1", 0.2, least, MOST) for name in ("mass_change", "pull"))


FREE_SURFACE = Effect(
    "free_surface",
    "the surface so near that masses change with depth",
    "water",
    _changes(LEAST),
    lambda course, values: _near(course, values, course.depth_m, course.world[2]),
    Separation(manoeuvres=("the same manoeuvres at two depths",)),
    needs=("depth",),
    telling=_mass_change,
    lasting=False,
)

BOTTOM_OR_WALL = Effect(
    "bottom_or_wall",
    "the bottom or a wall so near that masses change with altitude",
    "water",
    _changes(0.0),
    lambda course, values: _near(course, values, course.altitude_m, -course.world[2]),
    Separation(manoeuvres=("the same manoeuvres at two altitudes",)),
    needs=("altitude",),
    telling=_mass_change,
    lasting=False,
)

SURFACES = (FREE_SURFACE, BOTTOM_OR_WALL)


def _tether(course: Course, values: Array) -> Act:
    """A constant pull at the starting point, north and east, plus a spring from there: F = F0 - k (x - x0), level."""
    stiffness, north, east = values.tolist()
    wrench = np.zeros_like(course.nu)
    wrench[:, :3] = course.in_body(
        north - stiffness * course.position_m[:, 0], east - stiffness * course.position_m[:, 1]
    )
    return Act(wrench=wrench)


def _upright_pulls(course: Course, act: Act) -> Iterator[Act]:
    """Vertical pulls of a line that pulls level, linear and quadratic, since it stretches under load."""
    if act.wrench is None:
        return
    size = np.linalg.norm(act.wrench[:, :3], axis=1)
    for pull in (size, size**2):
        wrench = np.zeros_like(course.nu)
        wrench[:, :3] = pull[:, None] * course.world[2]
        yield Act(wrench=wrench)


TETHER = Effect(
    "tether",
    "a tether that pulls to one place",
    "force",
    (Parameter("stiffness", "N/m", 0.1, low=0.0), Parameter("north", "N", 0.5), Parameter("east", "N", 0.5)),
    _tether,
    Separation(manoeuvres=("out and back", "one speed at two distances", "a loose loop")),
    lasting=False,
    companions=_upright_pulls,
)

EFFECTS = (
    STEADY_CURRENT,
    *map(varying_current, CURRENT_PERIODS_S),
    *map(waves, WAVE_PERIODS_S),
    *SURFACES,
    TETHER,
)
