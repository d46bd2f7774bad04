"""A tether."""

import numpy as np
from numpy.typing import NDArray

from identify.effects.course import Course
from identify.effects.effect import Act, Effect, Parameter, Separation

Array = NDArray[np.float64]


def _tether(course: Course, values: Array) -> Act:
    """A constant pull at the starting point, north and east, plus a spring from there: F = F0 - k (x - x0), level."""
    stiffness, north, east = values.tolist()
    wrench = np.zeros_like(course.nu)
    wrench[:, :3] = course.in_body(
        north - stiffness * course.position_m[:, 0], east - stiffness * course.position_m[:, 1]
    )
    return Act(wrench=wrench)


TETHER = Effect(
    "tether",
    "a tether that pulls to one place",
    "force",
    (Parameter("stiffness", "N/m", 0.1, low=0.0), Parameter("north", "N", 0.5), Parameter("east", "N", 0.5)),
    _tether,
    Separation(manoeuvres=("out and back", "one speed at two distances", "a loose loop")),
    lasting=False,
)
