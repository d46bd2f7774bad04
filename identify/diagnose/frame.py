"""All candidates side by side in one regression, weighed as the noise is once the causes found so far are out."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from bridge.effects.course import Course
from bridge.effects.effect import Act, Effect
from identify.diagnose.evidence import Sums, sums_of
from identify.diagnose.nominal import Nominal
from identify.diagnose.whitened import Whitened, whitened

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Cause:
    """An effect with the values (p,) of its parameters."""

    effect: Effect
    values: Array

    def act(self, course: Course) -> Act:
        return self.effect.act(course, self.values)


@dataclass(frozen=True)
class Setting:
    """One way to try an effect: for each of `steps` (k, p) from its none, one column of the sums."""

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


@dataclass(frozen=True)
class Frame:
    """A dive's regression with the causes put back into what is to be explained, and the sums of all candidates."""

    sums: Sums
    settings: tuple[Setting, ...]
    rows: Whitened


def frame_of(now: Nominal, library: Sequence[Effect], causes: Sequence[Cause] = ()) -> Frame:
    """The frame in which the filters of `now` see all that the dive holds, what was taken out of it put back.

    The causes so far are tried as they were fitted too: one whose shape changes with its size is nowhere else as it is.
    """
    course = now.course
    rows = whitened(now.joint, now.theta, now.doubted)
    acts: list[Act] = []
    settings = []
    for effect in library:
        for size in effect.sizes:
            steps = _steps(effect, size)
            settings.append(Setting(effect, tuple(range(len(acts), len(acts) + len(steps))), steps))
            acts += [effect.act(course, _at(effect, step)) for step in steps]
    for cause in causes:
        none = cause.effect.none()
        step = np.where(np.isfinite(none), cause.values - none, cause.values)
        settings.append(Setting(cause.effect, (len(acts),), step[None]))
        acts.append(cause.act(course))
    columns = rows.columns(acts, course)
    back = rows.columns(now.acts, course).sum(axis=1)
    rows = replace(rows, value=rows.value + back)
    sums = sums_of(rows.value, rows.nominal, rows.nominal_precision, columns, rows.piece)
    return Frame(sums, tuple(settings), rows)


def _steps(effect: Effect, size: float) -> Array:
    """(k, p): each parameter from its none to so many times its start, one at a time; from infinity, to its start."""
    none, start = effect.none(), effect.start()
    if not np.isfinite(none).all():
        return np.array([start / size])
    return np.diag(size * (start - none))


def _at(effect: Effect, step: Array) -> Array:
    none = effect.none()
    return np.where(np.isfinite(none), none + step, step)
