"""What a cause brings along that no form of it says: that too is nothing unexplained, once the cause is found.

Of a quick cause whose form is not quite true a slow rest stays, for a filter takes it for a disturbance, which lasts; a
bias comes and goes; water that moves turns the hull as well as pushing it; thrust that gives way under load does so by
another law. The forms that the search allows for (`forms`) are fewer, so that a second cause keeps its evidence.
"""

from collections.abc import Iterator
from functools import partial

import numpy as np
from numpy.typing import NDArray

from bridge.effects.course import Course, lagged
from bridge.effects.effect import Act
from bridge.effects.supply import LOAD_SAG
from identify.diagnose.cause import Cause

Array = NDArray[np.float64]

SLOWER_S = (0.5, 1.5)
"""Lags of what a cause adds."""

TURNS = (2, 3)
"""Powers of time, from the middle of a dive, by which a cause comes and goes; its linear growth is among its forms."""

DRIFTS = (1, 2, 3)
"""The same of each parameter of what the water does, by itself: a current turns as it comes and goes, and one of a
narrow band of periods drifts in phase against that of one."""

LOADS = (0.7, 1.0, 1.4, 2.0)
"""Powers of thrust by which the load of all thrusters may go."""

LATER_S = 0.3
"""How long a supply may take to give way."""


def kin(course: Course, cause: Cause) -> Iterator[Act]:
    """Acts of what comes along with a cause, of any size."""
    own = cause.act(course)
    for lag_s in SLOWER_S:
        yield own.each(partial(lagged, step_s=course.step_s, lag_s=lag_s))
    middle = (2.0 * course.since_s / course.since_s[-1] - 1.0)[:, None]
    for power in TURNS:
        yield own.each(partial(np.multiply, middle**power))
    if cause.effect.place == "water":
        for p in np.flatnonzero(cause.present).tolist():
            part = cause.slope(course, p)
            for power in DRIFTS:
                yield part.each(partial(np.multiply, middle**power))
    if cause.effect.place == "water" and own.wrench is not None:
        yield from _turned(course, own.wrench[:, :3])
    if cause.effect.name == LOAD_SAG.name:
        yield from _loaded(course)


def _turned(course: Course, force: Array) -> Iterator[Act]:
    """Moments of water that pushes by `force` (n, 3): by a lever, and by its drift along the hull (Munk 1924), each in
    step with the force and a quarter of a period off."""
    u, v, w = course.nu[:, :3].T
    for push in (force, np.gradient(force, course.step_s, axis=0)):
        x, y, z = push.T
        for moment in ((y, x, y), (z, z, x), (v * z, u * z, u * y), (w * y, w * x, v * x)):
            yield Act(wrench=np.column_stack([np.zeros((len(u), 3)), *moment]))


def _loaded(course: Course) -> Iterator[Act]:
    """Thrust times the load of all thrusters, by other laws, at once and late."""
    thrust = course.thrust_n
    for power in LOADS:
        load = (np.abs(thrust) ** power).sum(axis=1, keepdims=True)
        for late_s in (0.0, LATER_S):
            yield Act(wrench=course.wrench_of(lagged(load, course.step_s, late_s) * thrust))
