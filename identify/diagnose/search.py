"""Which causes: added one at a time, changed for better ones, as long as held-out pieces of the dive gain by it."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bridge.effects.course import Course
from bridge.effects.effect import Act, Effect, Parameter
from identify.diagnose.evidence import Evidence
from identify.diagnose.frame import Cause, Frame, Setting, frame_of
from identify.diagnose.nominal import Nominal, refitted
from identify.diagnose.whitened import whitened

Array = NDArray[np.float64]

LEAST_GAIN = 6.0
"""Nats on held-out pieces that one more cause must save, among some forty that are tried."""

MOST_CAUSES, MOST_TURNS, MOST_STEPS = 3, 6, 6
SETTLED = 0.1
LEAST_Z = 1.5


@dataclass(frozen=True)
class Chosen:
    """A setting with the columns of it that count, and what speaks for it beside the others chosen."""

    setting: Setting
    columns: tuple[int, ...]


@dataclass(frozen=True)
class Explanation:
    """What the search came to: causes, the filters without them, and the frame in which all candidates were weighed."""

    causes: tuple[Cause, ...]
    now: Nominal
    frame: Frame
    chosen: tuple[Chosen, ...]


def explain(
    nominal: Nominal, library: Sequence[Effect], progress: Callable[[float, str], None]
) -> Explanation:
    """The causes of a dive's gap among the effects of a library."""
    causes: tuple[Cause, ...] = ()
    now = nominal
    for turn in range(MOST_TURNS):
        progress((turn + 0.5) / (MOST_TURNS + 1), "weighing the candidates")
        frame = frame_of(now, library, causes)
        # One more at a time: what the noise is without the first is known only once that has been fitted.
        chosen = select(frame, min(len(causes) + 1, MOST_CAUSES))
        if _names(chosen) == tuple(cause.effect.label for cause in causes):
            break
        sizes = _sizes(frame, chosen)
        causes = tuple(_cause(one, size) for one, size in zip(chosen, sizes, strict=True))
        progress((turn + 1.0) / (MOST_TURNS + 1), f"fitting {', '.join(_names(chosen)) or 'none of them'}")
        causes, now = polished(nominal, causes)
    return Explanation(causes, now, frame, chosen)


def _names(chosen: Sequence[Chosen]) -> tuple[str, ...]:
    return tuple(sorted(one.setting.effect.label for one in chosen))


def select(frame: Frame, most: int) -> tuple[Chosen, ...]:
    """At most so many, forward, each looked at again once another has come; sorted by label."""
    chosen: tuple[Chosen, ...] = ()
    total = 0.0
    while len(chosen) < most:
        gain, more = best_beside(frame, chosen)
        if more is None or gain - total < LEAST_GAIN:
            break
        chosen, total = (*chosen, more), gain
        for k in range(len(chosen) - 1):
            others = (*chosen[:k], *chosen[k + 1 :])
            gain, other = best_beside(frame, others)
            if other is not None and gain > total + 1.0:
                chosen, total = (*others, other), gain
    return tuple(sorted(chosen, key=lambda one: one.setting.effect.label))


def best_beside(frame: Frame, chosen: Sequence[Chosen]) -> tuple[float, Chosen | None]:
    """The held-out gain of all with the best one more, and that one."""
    taken = {_cause_of(one.setting.effect) for one in chosen}
    best: tuple[float, Chosen | None] = (-np.inf, None)
    for setting in frame.settings:
        if _cause_of(setting.effect) not in taken:
            gain, one = weighed(frame, chosen, setting)
            if gain > best[0]:
                best = gain, one
    return best


def _cause_of(effect: Effect) -> tuple[str, int]:
    """Effects with the same are one cause in several forms."""
    return effect.name, effect.number


def weighed(frame: Frame, chosen: Sequence[Chosen], setting: Setting) -> tuple[float, Chosen]:
    """A setting beside others, less those of its columns that say nothing."""
    fixed = [column for one in chosen for column in one.columns]
    columns = list(setting.columns)
    evidence = frame.sums.evidence([*fixed, *columns])
    while len(columns) > 1:
        z = _z(evidence)[len(fixed) :]
        kept = [column for column, far in zip(columns, z.tolist(), strict=True) if far > LEAST_Z]
        if len(kept) == len(columns):
            break
        columns = kept or [columns[int(np.argmax(z))]]
        evidence = frame.sums.evidence([*fixed, *columns])
    return evidence.gain, Chosen(setting, tuple(columns))


def _z(evidence: Evidence) -> Array:
    return np.asarray(np.abs(evidence.size) / np.sqrt(np.maximum(np.diag(evidence.covariance), 1e-30)))


def _sizes(frame: Frame, chosen: Sequence[Chosen]) -> list[Array]:
    evidence = frame.sums.evidence([column for one in chosen for column in one.columns])
    ends = np.cumsum([len(one.columns) for one in chosen])
    return list(np.split(evidence.size, ends[:-1])) if chosen else []


def _cause(one: Chosen, size: Array) -> Cause:
    whole = np.zeros(len(one.setting.columns))
    whole[[one.setting.columns.index(column) for column in one.columns]] = size
    return one.setting.cause(whole)


def polished(nominal: Nominal, causes: tuple[Cause, ...]) -> tuple[tuple[Cause, ...], Nominal]:
    """The causes' parameters and the nominal model's fitted together (Gauss and Newton); those that end where they are
    absent are gone."""
    now = _without(nominal, causes, nominal.course)
    for _ in range(MOST_STEPS):
        at = [(k, p) for k, cause in enumerate(causes) for p in np.flatnonzero(_present(cause)).tolist()]
        if not at:
            break
        step, std = _step(now, [_slope(now.course, causes[k], p) for k, p in at])
        values = [cause.values.copy() for cause in causes]
        for (k, p), move in zip(at, step.tolist(), strict=True):
            one = causes[k].effect.parameters[p]
            far = _scale(one)
            values[k][p] = float(np.clip(values[k][p] + np.clip(move, -far, far), one.low, one.high))
        moved = (Cause(cause.effect, value) for cause, value in zip(causes, values, strict=True))
        causes = tuple(cause for cause in moved if _present(cause).any())
        now = _without(nominal, causes, now.course)
        if np.all(np.abs(step) < SETTLED * std):
            break
    return causes, now


def _scale(one: Parameter) -> float:
    """The way from where a parameter means nothing to where it shows; a limit's is the limit itself."""
    return abs(one.start - one.none) if np.isfinite(one.none) else abs(one.start)


def _without(nominal: Nominal, causes: Sequence[Cause], course: Course) -> Nominal:
    """The dive less what the causes add along the best course so far: a worse model expects other velocities."""
    return refitted(nominal, [cause.act(course) for cause in causes])


def _present(cause: Cause) -> NDArray[np.bool_]:
    """Which of its parameters are not where it is absent, (p,)."""
    return np.asarray(cause.values != cause.effect.none())


def _step(now: Nominal, slopes: Sequence[Act]) -> tuple[Array, Array]:
    """What to change parameters with these slopes by, beside the nominal ones, and their standard errors (k,)."""
    rows = whitened(now.joint, now.theta, now.doubted)
    whole = np.column_stack([rows.nominal, rows.columns(slopes, now.course)])
    known = np.concatenate([rows.nominal_precision, np.zeros(len(slopes))])
    square = whole.T @ whole + np.diag(known)
    kept = slice(rows.nominal.shape[1], None)
    scale = np.sqrt(np.maximum(np.diag(square), 1e-300))
    inverse = np.linalg.pinv(square / np.outer(scale, scale), rcond=1e-10, hermitian=True)
    step = inverse @ (whole.T @ rows.value / scale) / scale
    std = np.sqrt(np.maximum(np.diag(inverse), 0.0)) / scale
    return np.asarray(step[kept]), np.asarray(std[kept])


def _slope(course: Course, cause: Cause, p: int) -> Act:
    """What the act changes by with one unit of its parameter p."""
    h = 0.02 * _scale(cause.effect.parameters[p])
    up, down = cause.values.copy(), cause.values.copy()
    up[p] += h
    down[p] -= h
    high, low = (cause.effect.act(course, v) for v in (up, down))

    def diff(name: str) -> Array | None:
        a, b = getattr(high, name), getattr(low, name)
        return None if a is None else (a - b) / (2 * h)

    return Act(
        *(
            diff(name)
            for name in ("wrench", "mass", "damping", "velocity", "gyro", "attitude", "specific_force")
        )
    )
