"""Influence of a nearby surface, bottom or wall on the added masses, and thereby on the forces."""

import numpy as np
from numpy.typing import NDArray

from identify.effects.course import Course
from identify.effects.effect import Act, Effect, Parameter, Separation, Told

Array = NDArray[np.float64]

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


def _told(values: Array) -> Told:
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
    telling=_told,
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
    telling=_told,
    lasting=False,
)

EFFECTS = (FREE_SURFACE, BOTTOM_OR_WALL)
