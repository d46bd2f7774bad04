"""From thrusts that are other than the nominal ones to what they add."""

import numpy as np
from numpy.typing import NDArray

from bridge.effects.course import Course
from bridge.effects.effect import Act

Array = NDArray[np.float64]


def past_the_shaft(course: Course, more_n: Array) -> Act:
    """Of what the thrusts (n, k) exceed the nominal ones by while the shafts turn as they are asked to."""
    return Act(wrench=course.wrench_of(more_n))


def before_the_shaft(course: Course, more_n: Array) -> Act:
    """Of what the thrusts (n, k) exceed the nominal ones by because the shafts turn otherwise than asked."""
    return Act(wrench=course.wrench_of(more_n), shaft_n=more_n)
