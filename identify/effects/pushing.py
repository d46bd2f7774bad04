"""Conversion of excess thrusts to an effect's contribution."""

import numpy as np
from numpy.typing import NDArray

from identify.effects.course import Course
from identify.effects.effect import Act

Array = NDArray[np.float64]


def past_the_shaft(course: Course, more_n: Array) -> Act:
    """Contribution of thrusts (n, k) in excess of the nominal ones, while the shafts turn as asked."""
    return Act(wrench=course.wrench_of(more_n))


def before_the_shaft(course: Course, more_n: Array) -> Act:
    """Contribution of thrusts (n, k) in excess of the nominal ones, because the shafts turn differently than asked."""
    return Act(wrench=course.wrench_of(more_n), shaft_n=more_n)
