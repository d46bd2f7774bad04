"""The readings of one degree of freedom in time order, as events of its filter, with long steps divided."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from bridge.arrays import Array
from identify.estimators.axes.readings import FEWEST, Channel
from identify.estimators.filter.state import INCREMENT, NO_STEP, POSITION, VELOCITY
from identify.thrust.wrench_history import WrenchHistory

LONGEST_STEP_S = 0.05
"""Longer steps between readings are divided, so that a force held over a step is not held for long."""

TICK_S, COARSE_TICK_S = 1e-5, 2.5e-4
"""Times are rounded to the first, in which no vehicle moves: then few steps differ, and each is computed once. If
MOST_STEPS still differ, as with readings on two clocks, they are rounded to the second, half of the error of such
stamps. A quiet gyro resolves even a tenth of that in a turn."""

MOST_STEPS = 500

FIRST_POSITION_STD = 0.1

LEAST_FIRST_M_S = 1e-3

LOUDNESS, QUIETEST = 4.0, 0.05
"""Step between levels of the power that slow samples of the commands hide, and the least, by its mean: a stick moves a
little even while it seems to rest."""


@dataclass(frozen=True)
class Events:
    """Readings of one degree of freedom, (n,) events in time order, with long steps divided; still without forces.

    step_s: time since the event before, equal to entry `step` of `different_s`; 0 at the first event. `step` is NO_STEP
    there, and less at the first event of each later run (`innovations.NO_STEP`). white_times, like different_s: the
    axis's white force over such a step, by its mean.
    reading: NaN if the event only divides a step. scale: standard deviation of a reading over its channel's noise.
    channel: index of the reading's entry in `channels`.
    initial (r, 4), by run: first speed, first angle or depth, and their variances.
    """

    dof: int
    time_s: Array
    step_s: Array
    different_s: Array
    white_times: Array
    step: NDArray[np.int64]
    reading: Array
    scale: Array
    state_read: NDArray[np.int64]
    channel: NDArray[np.int64]
    channels: tuple[Channel, ...]
    initial: Array

    @cached_property
    def runs(self) -> tuple[slice, ...]:
        """The events of each run."""
        firsts = [0, *np.flatnonzero(self.step < NO_STEP).tolist(), len(self.step)]
        return tuple(slice(a, b) for a, b in pairwise(firsts))

    @property
    def before_s(self) -> Array:
        """Times (n,) of the event before; its own for the first event of a run."""
        before = np.concatenate([self.time_s[:1], self.time_s[:-1]])
        return np.where(self.step < NO_STEP, self.time_s, before)

    @property
    def is_coloured(self) -> bool:
        """Whether the velocity readings have a slow error of their own, as those of an autopilot's filter do."""
        return self.channels[0].coloured > 0.0


@dataclass(frozen=True)
class _RunEvents:
    """Readings of an axis in time order within a run, (n,) each as in `Events`, with long steps divided."""

    time_s: Array
    value: Array
    scale: Array
    state: NDArray[np.int64]
    channel: NDArray[np.int64]
    initial: Array


def events_of(dof: int, channels: list[Channel], spans_s: Sequence[tuple[float, float]]) -> Events | None:
    """Return the readings of an axis in time order, with long steps divided; None if no run holds enough of them."""
    tick_s = _tick_s(channels)
    runs = [events for span_s in spans_s if (events := _run_events(channels, span_s, tick_s)) is not None]
    if not runs:
        return None
    count = [len(run.time_s) for run in runs]
    time_s = np.concatenate([run.time_s for run in runs])
    steps = [np.diff(run.time_s, prepend=run.time_s[0]) for run in runs]
    step_s = _in_ticks(np.concatenate(steps), tick_s)
    different_s, step = np.unique(step_s, return_inverse=True)
    empty = int(different_s[0] == 0.0)
    step = np.asarray(step - empty, dtype=np.int64)
    step[np.cumsum([0, *count[:-1]])] = NO_STEP - np.arange(len(runs))
    return Events(
        dof=dof,
        time_s=time_s,
        step_s=step_s,
        different_s=np.asarray(different_s[empty:], dtype=np.float64),
        white_times=np.ones(len(different_s) - empty),
        step=step,
        reading=np.concatenate([run.value for run in runs]),
        scale=np.concatenate([run.scale for run in runs]),
        state_read=np.concatenate([run.state for run in runs]),
        channel=np.concatenate([run.channel for run in runs]),
        channels=tuple(channels),
        initial=np.array([run.initial for run in runs]),
    )


def loud_and_quiet(events: Events, force: WrenchHistory) -> Events:
    """Events whose steps are told apart by how much force the log of the commands hides over each, in powers of
    LOUDNESS."""
    power = force.hidden_power_between(events.time_s - events.step_s, events.time_s)[:, 0]
    step, of, level = told_apart(events, levels(power))
    return replace(
        events, different_s=events.different_s[of], white_times=np.sqrt(LOUDNESS**level), step=step
    )


def levels(power: Array) -> Array:
    """Whole powers of LOUDNESS (n,) nearest to `power` (n,), which is by some mean; none below QUIETEST."""
    return np.asarray(np.round(np.log(np.maximum(power, QUIETEST)) / np.log(LOUDNESS)))


def told_apart(events: Events, level: Array) -> tuple[NDArray[np.int64], NDArray[np.int64], Array]:
    """Steps (n,) split by their level (n,), as entries of the different steps (k,) that result: of each of these
    the entry of `different_s` before, and its level."""
    stepped = events.step >= 0
    kinds = np.column_stack([events.step[stepped], level[stepped]])
    different, at = np.unique(kinds, axis=0, return_inverse=True)
    step = events.step.copy()
    step[stepped] = at.reshape(-1)
    return step, different[:, 0].astype(np.int64), different[:, 1]


def _run_events(channels: Sequence[Channel], span_s: tuple[float, float], tick_s: float) -> _RunEvents | None:
    time_s = _in_ticks(np.concatenate([c.time_s for c in channels]), tick_s)
    value = np.concatenate([c.value for c in channels])
    scale = np.concatenate([c.scale for c in channels])
    state = np.concatenate([np.full(len(c.time_s), c.state_read, dtype=np.int64) for c in channels])
    channel = np.concatenate([np.full(len(c.time_s), i, dtype=np.int64) for i, c in enumerate(channels)])
    keep = np.flatnonzero((time_s >= span_s[0]) & (time_s <= span_s[1]))
    order = keep[np.argsort(time_s[keep], kind="stable")]
    time_s, value, scale = (a[order] for a in (time_s, value, scale))
    state, channel = state[order], channel[order]
    if np.count_nonzero(np.isfinite(value) & (state == channels[0].state_read)) < FEWEST:
        return None
    # An increment that began before the first event is incomplete.
    whole = state != INCREMENT
    value = np.where(whole | (np.cumsum(~whole) > 1), value, np.nan)
    initial = _initial(time_s, value, scale, state)
    between = _in_ticks(_dividing(time_s), tick_s)
    before = np.searchsorted(time_s, between)
    return _RunEvents(
        np.insert(time_s, before, between),
        np.insert(value, before, np.nan),
        np.insert(scale, before, 1.0),
        np.insert(state, before, VELOCITY),
        np.insert(channel, before, 0),
        initial,
    )


def _tick_s(channels: Sequence[Channel]) -> float:
    """The tick to which an axis's times are rounded."""
    time_s = np.sort(np.concatenate([channel.time_s for channel in channels]))
    steps = np.unique(np.round(np.diff(time_s) / TICK_S))
    return TICK_S if len(steps) <= MOST_STEPS else COARSE_TICK_S


def _in_ticks(time_s: Array, tick_s: float) -> Array:
    return np.asarray(np.round(time_s / tick_s) * tick_s, dtype=np.float64)


def _dividing(time_s: Array) -> Array:
    """Times that divide every step longer than LONGEST_STEP_S into equal parts."""
    step_s = np.diff(time_s)
    pieces = np.ceil(step_s / LONGEST_STEP_S - 1e-6).astype(np.int64)
    extra = np.maximum(pieces - 1, 0)
    step = np.repeat(np.arange(len(step_s)), extra)
    count = np.arange(len(step)) - np.repeat(np.cumsum(extra) - extra, extra) + 1
    return np.asarray(time_s[step] + count * step_s[step] / pieces[step])


def _initial(time_s: Array, value: Array, scale: Array, state: NDArray[np.int64]) -> Array:
    moving = (state != POSITION) & np.isfinite(value)
    position = value[state == POSITION]
    speed = (value / scale)[moving] if moving.any() else _rate_of(time_s, value)
    least = 1e-4 if moving.any() else LEAST_FIRST_M_S
    return np.array(
        [speed[0], position[:1].sum(), max(float(np.std(speed)), least) ** 2, FIRST_POSITION_STD**2]
    )


def _rate_of(time_s: Array, position: Array) -> Array:
    """Speeds from successive readings of a position or angle."""
    step_s = np.diff(time_s)
    return np.asarray(np.diff(position)[step_s > 0] / step_s[step_s > 0])
