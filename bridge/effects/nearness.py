"""What a surface, a bottom or a wall nearby does to the added masses, and by these to the forces."""

import numpy as np
from numpy.typing import NDArray

from bridge.effects.course import Course
from bridge.effects.effect import Act, Effect, Parameter, Separation, Told

Array = NDArray[np.float64]

REFERENCE_M = 0.5
"""`mass_change` is told for so far from the boundary."""

HALF_HEIGHT_M = 0.25
"""Of a hull: its middle is never nearer."""

SHARES = np.array([0.25, 1.0, 1.0, 0.0, 0.0, 0.0])
"""Of the change in each degree of freedom: none in surge for a cylinder, half for a sphere (Lamb 1932, article 99);
a hull lies between these."""

MOST = 2.0
"""A cylinder of 1 m radius at `REFERENCE_M`: none of these vehicles is thicker."""

LEAST = -0.2
"""Waves may take added mass away below a free surface, but no more than all of it where the hull touches it."""


def _near(course: Course, values: Array, far_m: Array, away: Array) -> Act:
    """Added masses larger by `values[0]` at `REFERENCE_M`, falling as the distance squared: M_A (1 + a^2 / (2 h^2)) of
    a cylinder beside a wall (Lamb 1932, section 72). Nothing where no distance is known.

    What is added to M_A brings its own Coriolis force (Fossen 2011, eq. 6.43 and 6.44), or else it would make a Munk
    moment that is none. As it changes with the distance h, the water's energy pushes, too: along `away` (n, 3), on
    which h grows, by dM_A/dh nu^2 / 2, less dM_A/dt nu (Lagrange's equations; Lamb 1932, section 137). That is as large
    as a change of `values[1]` makes it: by which power of the distance a hull's masses fall nobody knows (2 of a
    cylinder, 3 of a sphere), and at nearly one distance a refit takes the masses up, but not what they pull by.
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
    """The masses' change by what they weigh, or else by how they pull."""
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
)

EFFECTS = (FREE_SURFACE, BOTTOM_OR_WALL)
