"""What a cause brings along that no form of it says: that too is nothing unexplained, once the cause is found.

Of a quick cause whose form is not quite true a slow rest stays, for a filter takes it for a disturbance, which lasts; a
bias comes and goes; water that moves turns the hull as well as pushing it, and a sea has more lines than any form of
it; a line that pulls along pulls down; thrust that gives way under load does so by another law. A reading that is wrong
by where its sensor sits is so at once and in proportion, and brings nothing along but that it may come and go. The
forms that the search allows for (`forms`) are fewer, so that a second cause keeps its evidence.
"""

from collections.abc import Iterator
from functools import partial

import numpy as np
from numpy.typing import NDArray

from bridge.effects.course import Course, lagged
from bridge.effects.effect import Act
from bridge.effects.supply import LOAD_SAG
from bridge.effects.tether import TETHER
from identify.diagnose.cause import Cause

Array = NDArray[np.float64]

SLOWER_S = (0.5, 1.5)
"""Lags of what a cause adds."""

TURNS = (2, 3)
"""Powers of time, from the middle of a dive, by which a cause comes and goes; its linear growth is among its forms."""

DRIFTS = (1, 2, 3)
"""The same of each parameter of what the water does, by itself: a current turns as it comes and goes, and one of a
narrow band of periods drifts in phase against that of one."""

BESIDE, MOST_BESIDE = 0.2, 8
"""A sea is a band of periods, of which a dive tells as many apart as it is long: all so near to the strongest line's
rate are of that sea, and so many on either side of it are looked at."""

LOADS = (0.7, 1.0, 1.4, 2.0)
"""Powers of thrust by which the load of all thrusters may go."""

LATER_S = 0.3
"""How long a supply may take to give way."""


def kin(course: Course, cause: Cause) -> Iterator[Act]:
    """Acts of what comes along with a cause, of any size."""
    own = cause.act(course)
    if cause.effect.place != "reading":
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
        yield from _of_its_band(course, cause)
    if cause.effect.place == "water" and own.wrench is not None:
        yield from _turned(course, own.wrench[:, :3])
    if cause.effect.name == LOAD_SAG.name:
        yield from _loaded(course)
    if cause.effect.name == TETHER.name and own.wrench is not None:
        yield from _hanging(course, own.wrench[:, :3])


def _of_its_band(course: Course, cause: Cause) -> Iterator[Act]:
    """The strongest line of a sea at the rates beside its own that the dive tells from it."""
    told = cause.effect.told(cause.values)
    if "period" not in told:
        return
    whole_s = float(course.since_s[-1])
    beside = min(int(np.ceil(BESIDE * whole_s / told["period"][0])), MOST_BESIDE)
    each = len({one.name for one in cause.effect.parameters})
    strongest = int(np.argmax(np.linalg.norm(cause.values.reshape(-1, each), axis=1)))
    for p in range(strongest * each, (strongest + 1) * each):
        part = cause.slope(course, p)
        for k in range(1, beside + 1):
            angle = (2 * np.pi * k / whole_s * course.since_s)[:, None]
            yield part.each(partial(np.multiply, np.sin(angle)))
            yield part.each(partial(np.multiply, np.cos(angle)))


def _turned(course: Course, force: Array) -> Iterator[Act]:
    """Moments of water that pushes by `force` (n, 3): by a lever, and by its drift along the hull (Munk 1924), each in
    step with the force and a quarter of a period off."""
    u, v, w = course.nu[:, :3].T
    for push in (force, np.gradient(force, course.step_s, axis=0)):
        x, y, z = push.T
        for moment in ((y, x, y), (z, z, x), (v * z, u * z, u * y), (w * y, w * x, v * x)):
            yield Act(wrench=np.column_stack([np.zeros((len(u), 3)), *moment]))


def _hanging(course: Course, force: Array) -> Iterator[Act]:
    """Upright pulls of a line that pulls level by `force` (n, 3): with that, and with its square, for it is drawn out
    the further the more it pulls."""
    size = np.linalg.norm(force, axis=1)
    for pull in (size, size**2):
        wrench = np.zeros_like(course.nu)
        wrench[:, :3] = pull[:, None] * course.world[2]
        yield Act(wrench=wrench)


def _loaded(course: Course) -> Iterator[Act]:
    """Thrust times the load of all thrusters, by other laws, at once and late."""
    thrust = course.thrust_n
    for power in LOADS:
        load = (np.abs(thrust) ** power).sum(axis=1, keepdims=True)
        for late_s in (0.0, LATER_S):
            yield Act(wrench=course.wrench_of(lagged(load, course.step_s, late_s) * thrust))
