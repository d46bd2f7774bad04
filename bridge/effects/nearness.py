"""What a surface, a bottom or a wall nearby does to the added masses."""

import numpy as np
from numpy.typing import NDArray

from bridge.effects.course import Course
from bridge.effects.effect import Act, Effect, Parameter

Array = NDArray[np.float64]

REFERENCE_M = 0.5
"""`mass_change` is told for so far from the boundary."""

NEAREST_M = 0.25
"""A hull's own half height: nearer it does not get."""


def _near(course: Course, values: Array, far_m: Array) -> Act:
    """Added masses larger by `values[0]` at `REFERENCE_M`, falling as the distance squared: M_A (1 + a^2 / (2 h^2)) of
    a cylinder beside a wall (Lamb 1932, section 72). Nothing where no distance is known."""
    distance = np.maximum(far_m, NEAREST_M)
    more = np.where(np.isfinite(far_m), values[0] * (REFERENCE_M / distance) ** 2, 0.0)
    wrench = np.zeros_like(course.nu)
    added = np.maximum(course.added_mass[1:3], 0.0)
    wrench[:, 1:3] = -more[:, None] * added * course.nu_dot[:, 1:3]
    return Act(wrench=wrench)


FREE_SURFACE = Effect(
    "free_surface",
    "the surface so near that masses change with depth",
    "water",
    (Parameter("mass_change", "1", 0.2),),
    lambda course, values: _near(course, values, course.depth_m),
    "the same manoeuvres at two depths",
    needs=("depth",),
)

BOTTOM_OR_WALL = Effect(
    "bottom_or_wall",
    "the bottom or a wall so near that masses change with altitude",
    "water",
    (Parameter("mass_change", "1", 0.2),),
    lambda course, values: _near(course, values, course.altitude_m),
    "the same manoeuvres at two altitudes",
    needs=("altitude",),
)

EFFECTS = (FREE_SURFACE, BOTTOM_OR_WALL)
