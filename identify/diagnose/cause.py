"""An effect with values: what may cause a gap, and the ways in which it is tried."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bridge.effects.course import Course
from bridge.effects.effect import Act, Effect, Parameter

Array = NDArray[np.float64]

NEAR = 0.02

LEAST_SIZE = 0.12
"""Of the way on which a parameter comes to show."""


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
        none, size = self.effect.none(), np.array([way(p) for p in self.effect.parameters])
        return bool(np.any(np.isinf(none) | (np.abs(self.values - none) > LEAST_SIZE * size)))

    def act(self, course: Course) -> Act:
        return self.effect.act(course, self.values)

    def moved(self, p: int, by: float) -> "Cause":
        """With one parameter changed within its bounds; by no more than the way on which it comes to show, where what
        it adds is not proportional to it."""
        one, values = self.effect.parameters[p], self.values.copy()
        far = np.inf if self.effect.linear else way(one)
        values[p] = float(np.clip(values[p] + np.clip(by, -far, far), one.low, one.high))
        return Cause(self.effect, values)

    def slope(self, course: Course, p: int) -> Act:
        """What the act changes by with one unit of its parameter p."""
        h = NEAR * way(self.effect.parameters[p])
        up, down = self.values.copy(), self.values.copy()
        up[p] += h
        down[p] -= h
        high, low = (self.effect.act(course, values) for values in (up, down))
        return high.less(low).times(1.0 / (2 * h))


def way(one: Parameter) -> float:
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
