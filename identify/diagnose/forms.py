"""What another form of a cause would add: what these take up is nobody's evidence for a second cause.

A sea holds no form of any library: drag goes with a power that is not quite two, a dead zone has soft edges, a lag is
of second order. The larger an effect, the clearer is what its form leaves, and the first false cause takes it up.
"""

from collections.abc import Iterator
from functools import partial

import numpy as np
from numpy.typing import NDArray

from bridge.effects.course import Course, delayed
from bridge.effects.effect import Act
from identify.diagnose.cause import Cause

Array = NDArray[np.float64]

OTHER_SIZES = (0.5, 2.0)
POWERS = (0.6, 1.6)
"""The shape of what a cause adds is bent to these powers of itself: weaker and stronger where it is large."""

LATER_S = 0.2


def forms(course: Course, cause: Cause) -> Iterator[Act]:
    """Acts of the cause at other sizes, bent in size, late, and growing over the dive."""
    own = cause.act(course)
    yield from _able(course, cause)
    for power in POWERS:
        yield own.each(partial(_bent, power=power))
    yield own.each(lambda part: delayed(part, course.step_s, LATER_S) - part)


def able_forms(course: Course, cause: Cause) -> Iterator[Act]:
    """Those of `forms` that a cause may truly have: a reading that is wrong by where its sensor sits is so at once and
    in proportion, by geometry, and what is bent or late in it is something else."""
    return _able(course, cause) if cause.effect.place == "reading" else forms(course, cause)


def _able(course: Course, cause: Cause) -> Iterator[Act]:
    effect, own = cause.effect, cause.act(course)
    if not effect.linear:
        none = effect.none()
        # A limit is absent at infinity; its other sizes are shares of itself.
        origin = np.where(np.isfinite(none), none, 0.0)
        for size in OTHER_SIZES:
            yield effect.act(course, origin + size * (cause.values - origin))
    growing = course.since_s[:, None] / course.since_s[-1] - 0.5
    yield own.each(lambda part: growing * part)


def _bent(part: Array, power: float) -> Array:
    size = np.maximum(np.sqrt(np.mean(part**2, axis=0)), 1e-12)
    return np.asarray(np.sign(part) * np.abs(part / size) ** power * size)
