"""An effect with values: what may cause a gap, and the ways in which it is tried.

What another form of a cause would add: what these take up is nobody's evidence for a second cause.

A sea holds no form of any library: drag goes with a power that is not quite two, a dead zone has soft edges, a lag is
of second order. The larger an effect, the clearer is what its form leaves, and the first false cause takes it up.

What a cause brings along that no form of it says: that too is nothing unexplained, once the cause is found.

Of a quick cause whose form is not quite true a slow rest stays, for a filter takes it for a disturbance, which lasts; a
bias comes and goes; water that moves turns the hull as well as pushing it, and a sea has more lines than any form of
it; a line that pulls along pulls down; thrust that gives way under load does so by another law. A reading that is wrong
by where its sensor sits is so at once and in proportion, and brings nothing along but that it may come and go. The
forms that the search allows for (`forms`) are fewer, so that a second cause keeps its evidence.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.typing import NDArray

from bridge.effects.course import Course, delayed, lagged
from bridge.effects.effect import Act, Effect, Parameter
from bridge.effects.supply import LOAD_SAG
from bridge.effects.tether import TETHER

Array = NDArray[np.float64]

NEAR = 0.02

LEAST_SIZE = 0.12
"""Of the way on which a parameter comes to show."""

OTHER_SIZES = (0.5, 2.0)
POWERS = (0.6, 1.6)
"""The shape of what a cause adds is bent to these powers of itself: weaker and stronger where it is large."""

LATER_S = 0.2

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

GIVES_WAY_S = 0.3
"""How long a supply may take to give way."""


@dataclass(frozen=True)
class Cause:
    """An effect with the values (p,) of its parameters."""

    effect: Effect
    values: Array

    @property
    def key(self) -> tuple[str, int]:
        """Effects with the same are one cause in several forms."""
        return self.effect.name, self.effect.number

    @property
    def present(self) -> NDArray[np.bool_]:
        """Which of its parameters are not where it is absent, (p,)."""
        return np.asarray(self.values != self.effect.none())

    @property
    def shows(self) -> bool:
        """Whether any parameter is far enough from where it is absent to matter to anyone."""
        none, size = self.effect.none(), np.array([natural_scale(p) for p in self.effect.parameters])
        return bool(np.any(np.isinf(none) | (np.abs(self.values - none) > LEAST_SIZE * size)))

    def act(self, course: Course) -> Act:
        return self.effect.act(course, self.values)

    def moved(self, p: int, by: float) -> "Cause":
        """With one parameter changed within its bounds; by no more than the way on which it comes to show, where what
        it adds is not proportional to it."""
        one, values = self.effect.parameters[p], self.values.copy()
        far = np.inf if self.effect.linear else natural_scale(one)
        values[p] = float(np.clip(values[p] + np.clip(by, -far, far), one.low, one.high))
        return Cause(self.effect, values)

    def slope(self, course: Course, p: int) -> Act:
        """What the act changes by with one unit of its parameter p."""
        h = NEAR * natural_scale(self.effect.parameters[p])
        up, down = self.values.copy(), self.values.copy()
        up[p] += h
        down[p] -= h
        high, low = (self.effect.act(course, values) for values in (up, down))
        return high.less(low).times(1.0 / (2 * h))


def natural_scale(one: Parameter) -> float:
    """From where a parameter means nothing to where it shows; a limit's is the limit itself."""
    return abs(one.start - one.none) if np.isfinite(one.none) else abs(one.start)


@dataclass(frozen=True)
class Setting:
    """One way to try an effect: for each of `steps` (k, p) from its none, one column."""

    effect: Effect
    columns: tuple[int, ...]
    steps: Array

    def cause(self, size: Array) -> Cause:
        """The cause that sizes (k,) of the columns come to, within its bounds."""
        low = np.array([p.low for p in self.effect.parameters])
        high = np.array([p.high for p in self.effect.parameters])
        none = self.effect.none()
        if not np.isfinite(none).all():
            return Cause(self.effect, np.clip(self.steps[0], low, high))
        return Cause(self.effect, np.clip(none + size @ self.steps, low, high))


def settings_of(effects: tuple[Effect, ...], course: Course) -> tuple[tuple[Setting, ...], list[Act]]:
    """All ways to try some effects, with the act of every column."""
    acts: list[Act] = []
    settings = []
    for effect in effects:
        for size in effect.sizes:
            steps = _steps(effect, size)
            settings.append(Setting(effect, tuple(range(len(acts), len(acts) + len(steps))), steps))
            acts += [effect.act(course, _at(effect, step)) for step in steps]
    return tuple(settings), acts


def _steps(effect: Effect, size: float) -> Array:
    """(k, p): each parameter from its none to so many times its start, one at a time; from infinity, to its start."""
    none, start = effect.none(), effect.start()
    if not np.isfinite(none).all():
        return np.array([start / size])
    return np.diag(size * (start - none))


def _at(effect: Effect, step: Array) -> Array:
    none = effect.none()
    return np.where(np.isfinite(none), none + step, step)


def other_forms(course: Course, cause: Cause) -> Iterator[Act]:
    """Acts of the cause at other sizes, bent in size, late, and growing over the dive."""
    own = cause.act(course)
    yield from _possible(course, cause)
    for power in POWERS:
        yield own.each(partial(_bent, power=power))
    yield own.each(lambda part: delayed(part, course.step_s, LATER_S) - part)


def possible_forms(course: Course, cause: Cause) -> Iterator[Act]:
    """Those of `forms` that a cause may truly have: a reading that is wrong by where its sensor sits is so at once and
    in proportion, by geometry, and what is bent or late in it is something else."""
    return _possible(course, cause) if cause.effect.place == "reading" else other_forms(course, cause)


def _possible(course: Course, cause: Cause) -> Iterator[Act]:
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


def companions(course: Course, cause: Cause) -> Iterator[Act]:
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
        yield from _band(course, cause)
    if cause.effect.place == "water" and own.wrench is not None:
        yield from _moments(course, own.wrench[:, :3])
    if cause.effect.name == LOAD_SAG.name:
        yield from _load_losses(course)
    if cause.effect.name == TETHER.name and own.wrench is not None:
        yield from _upright_pulls(course, own.wrench[:, :3])


def _band(course: Course, cause: Cause) -> Iterator[Act]:
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


def _moments(course: Course, force: Array) -> Iterator[Act]:
    """Moments of water that pushes by `force` (n, 3): by a lever, and by its drift along the hull (Munk 1924), each in
    step with the force and a quarter of a period off."""
    u, v, w = course.nu[:, :3].T
    for push in (force, np.gradient(force, course.step_s, axis=0)):
        x, y, z = push.T
        for moment in ((y, x, y), (z, z, x), (v * z, u * z, u * y), (w * y, w * x, v * x)):
            yield Act(wrench=np.column_stack([np.zeros((len(u), 3)), *moment]))


def _upright_pulls(course: Course, force: Array) -> Iterator[Act]:
    """Upright pulls of a line that pulls level by `force` (n, 3): with that, and with its square, for it is drawn out
    the further the more it pulls."""
    size = np.linalg.norm(force, axis=1)
    for pull in (size, size**2):
        wrench = np.zeros_like(course.nu)
        wrench[:, :3] = pull[:, None] * course.world[2]
        yield Act(wrench=wrench)


def _load_losses(course: Course) -> Iterator[Act]:
    """Thrust times the load of all thrusters, by other laws, at once and late."""
    thrust = course.thrust_n
    for power in LOADS:
        load = (np.abs(thrust) ** power).sum(axis=1, keepdims=True)
        for late_s in (0.0, GIVES_WAY_S):
            yield Act(wrench=course.wrench_of(lagged(load, course.step_s, late_s) * thrust))
