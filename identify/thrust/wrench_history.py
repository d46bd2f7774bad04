"""The wrench of a dive at any time, between its commands too.

A command holds from its own time to the next command's. All thrusters share one first-order lag, so the lag acts on
the wrench: between two commands the wrench is W + (w - W) exp(-s / lag), with W the commanded wrench, w the wrench at
the command and s the time since the command. This is exact, and so is its integral.
"""

from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import pairwise
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from bridge.arrays import Array
from bridge.vehicle.config import ThrustCurve
from identify.dive import Signal

BETWEEN = 8
"""Steps between two slow samples."""

JUMP = 2.0
"""A change of slow samples by this many times those beside it is a step at an unknown time."""


@dataclass(frozen=True)
class WrenchHistory:
    """The thrusters' wrench about the body's origin, N and N m, at any time. Before the first command it is constant.

    `time_s` (n,): when each command begins to act, the delay after it was given.
    `asked` (n, 6): the wrench that each command settles at after the lag.
    `state` (n, 6): the wrench at each command.
    `integral` (n, 6): integral of the wrench from the first command on. `moment` (n, 6): integral of `integral`.
    `hidden` (6,): white force that the log hides, in N (N m) per square root of 1/s, from rounding commands to whole
    microseconds and from sampling them slowly.
    `hidden_power` (k, 6): the power of that force from each of k + 1 slow samples to the next, by its mean; empty where
    it is the same throughout.
    `source`: the thrusters' commands, pulses or newtons, or TAU_CMD. `sampled_s`: time between slow samples of the
    commands, 0 if the commands are known at all times. `stepped`: the history if slow samples step halfway to the next
    instead of going straight to it; None without such samples. `unknown_s` (6,): the interval of samples between
    which the wrench's answers to the motion are unknown; 0 where they are recorded, where reckoning is good enough for
    a delay, and where the wrench was at rest. `breaks_s` (r - 1,): times between the runs of a dive; before the first
    command of each run the wrench is constant.
    """

    time_s: Array
    asked: Array
    state: Array
    integral: Array
    moment: Array
    lag_s: float
    source: Literal["pwm", "tau_cmd"]
    notes: tuple[str, ...] = ()
    hidden: Array = field(default_factory=lambda: np.zeros(6))
    hidden_power: Array = field(default_factory=lambda: np.zeros((0, 6)))
    sampled_s: float = 0.0
    breaks_s: Array = field(default_factory=lambda: np.zeros(0))
    stepped: "WrenchHistory | None" = None
    unknown_s: Array = field(default_factory=lambda: np.zeros(6))

    @cached_property
    def firsts(self) -> NDArray[np.intp]:
        """Index (r + 1,) of the first command of each run, then the number of commands."""
        return np.concatenate([[0], np.searchsorted(self.time_s, self.breaks_s), [len(self.time_s)]])

    @property
    def spans_s(self) -> list[tuple[float, float]]:
        """Times of the first and the last command of each run that has any."""
        pairs = pairwise(self.firsts.tolist())
        return [(float(self.time_s[a]), float(self.time_s[b - 1])) for a, b in pairs if a < b]

    def along(self, dof: int) -> "WrenchHistory":
        """Return the component of one degree of freedom: every (n, 6) becomes (n, 1)."""
        axis = slice(dof, dof + 1)
        return replace(
            self,
            asked=self.asked[:, axis],
            state=self.state[:, axis],
            integral=self.integral[:, axis],
            moment=self.moment[:, axis],
            hidden=self.hidden[axis],
            hidden_power=self.hidden_power[:, axis],
            unknown_s=self.unknown_s[axis],
            stepped=None if self.stepped is None else self.stepped.along(dof),
        )

    def at(self, time_s: Array) -> Array:
        """Wrench (m, 6) at the times (m,)."""
        index, since_s = self._segment(time_s)
        asked = self.asked[index]
        value: Array = asked + (self.state[index] - asked) * _decay(since_s, self.lag_s)[:, None]
        return value

    def mean_between(self, start_s: Array, end_s: Array) -> Array:
        """Mean wrench (m, 6) over each interval [start, end]; the value at the start for an empty interval."""
        span_s = end_s - start_s
        empty = span_s <= 0
        area = self._integral_to(end_s) - self._integral_to(start_s)
        mean = area / np.where(empty, 1.0, span_s)[:, None]
        return np.where(empty[:, None], self.at(start_s), mean)

    def halves_between(self, start_s: Array, end_s: Array) -> Array:
        """Two constant halves of each interval, (m, 2, 6), with the same area and first moment as the wrench.

        They take a body to the same speed and the same place at the end of the interval as the wrench itself would,
        except for the effect of damping on the difference. For an empty interval both halves are the value itself.
        """
        span_s = (end_s - start_s)[:, None]
        mean = self.mean_between(start_s, end_s)
        moment = self._moment_to(end_s) - self._moment_to(start_s) - span_s * self._integral_to(start_s)
        early = np.where(span_s > 0, 4.0 * moment / np.where(span_s > 0, span_s, 1.0) ** 2 - mean, mean)
        return np.stack([early, 2.0 * mean - early], axis=1)

    def hidden_power_between(self, start_s: Array, end_s: Array) -> Array:
        """Power (m, 6) of the hidden force over each interval, by its mean over the dive."""
        if not len(self.hidden_power):
            return np.ones((len(start_s), self.hidden.size))
        edges_s = self.time_s[::BETWEEN]
        middle_s, half_s = 0.5 * (start_s + end_s), np.maximum(0.5 * (end_s - start_s), 1e-6)
        energy = np.cumsum(self.hidden_power * np.diff(edges_s)[:, None], axis=0)
        sums = [
            np.interp(middle_s + sign * half_s, edges_s, np.r_[0.0, column])
            for column in energy.T
            for sign in (1, -1)
        ]
        gained = np.column_stack(sums[::2]) - np.column_stack(sums[1::2])
        return np.asarray(gained / (2.0 * half_s[:, None]))

    def _segment(self, time_s: Array) -> tuple[NDArray[np.intp], Array]:
        index = np.maximum(np.searchsorted(self.time_s, time_s, side="right") - 1, 0)
        if len(self.breaks_s):
            first = self.firsts[np.searchsorted(self.breaks_s, time_s, side="right")]
            index = np.minimum(np.maximum(index, first), len(self.time_s) - 1)
        return index, time_s - self.time_s[index]

    def _integral_to(self, time_s: Array) -> Array:
        index, since_s = self._segment(time_s)
        area: Array = self.integral[index] + _area(self.asked[index], self.state[index], since_s, self.lag_s)
        return area

    def _moment_to(self, time_s: Array) -> Array:
        """Integral of `_integral_to`."""
        index, since_s = self._segment(time_s)
        asked, state = self.asked[index], self.state[index]
        since_command = _moment(asked, state, since_s, self.lag_s)
        moment: Array = self.moment[index] + self.integral[index] * since_s[:, None] + since_command
        return moment


def evenly_between(samples: Signal) -> Signal:
    """Return slow samples with BETWEEN even steps from each sample to the next."""
    at = np.arange(BETWEEN * (len(samples) - 1) + 1) / BETWEEN
    number = np.arange(len(samples))
    # A step holds until the next step, so its middle lies half a step later.
    value = [np.interp(at + 0.5 / BETWEEN, number, column) for column in samples.value.T]
    return Signal(np.interp(at, number, samples.time_s), np.column_stack(value))


def is_jump(samples: Array) -> NDArray[np.bool_]:
    """Whether each change (n - 1,) between slow samples (n, k) is a step: far larger than the changes beside it."""
    size = np.sum(np.diff(samples, axis=0) ** 2, axis=1)
    neighbour = np.maximum(np.concatenate([[0.0], size[:-1]]), np.concatenate([size[1:], [0.0]]))
    return np.asarray(size > JUMP**2 * neighbour)


def halfway_between(samples: Signal) -> Signal:
    """Return slow samples that each hold until halfway to the next, and from halfway to it on."""
    middle_s = 0.5 * (samples.time_s[1:] + samples.time_s[:-1])
    return Signal(np.concatenate([samples.time_s[:1], middle_s]), samples.value)


def history_of(
    asked: Signal,
    curve: ThrustCurve,
    source: Literal["pwm", "tau_cmd"],
    notes: tuple[str, ...],
    breaks_s: Array,
) -> WrenchHistory:
    """The history of commanded wrenches (n, 6), each held until the next, through the curve's delay and lag."""
    asked, lag_s = Signal(asked.time_s + curve.delay_s, asked.value), curve.lag_s
    step_s = np.diff(asked.time_s)
    decay = _decay(step_s, lag_s)
    runs = np.split(np.arange(len(asked)), np.searchsorted(asked.time_s, breaks_s))
    state = np.vstack([lagged_states(asked.value[run], decay[run[:-1]]) for run in runs if len(run)])
    areas = _area(asked.value[:-1], state[:-1], step_s, lag_s)
    integral = np.concatenate((np.zeros((1, 6)), np.cumsum(areas, axis=0)))
    moments = integral[:-1] * step_s[:, None] + _moment(asked.value[:-1], state[:-1], step_s, lag_s)
    moment = np.concatenate((np.zeros((1, 6)), np.cumsum(moments, axis=0)))
    return WrenchHistory(
        asked.time_s, asked.value, state, integral, moment, lag_s, source, notes, breaks_s=breaks_s
    )


def lagged_states(asked: Array, decay: Array) -> Array:
    """Return w with w[0] = W[0], w[k + 1] = decay[k] w[k] + (1 - decay[k]) W[k], as a scan in log2(n) passes."""
    factor = np.concatenate(([0.0], decay))
    state = np.concatenate((asked[:1], (1 - decay)[:, None] * asked[:-1]))
    reach = 1
    while reach < len(state):
        state[reach:] = state[reach:] + factor[reach:, None] * state[:-reach]
        factor[reach:] = factor[reach:] * factor[:-reach]
        reach *= 2
    return state


def _decay(since_s: Array, lag_s: float) -> Array:
    """Share of a difference that remains after `since_s`; all of it before the first command, when nothing has begun
    to change."""
    since_s = np.maximum(since_s, 0.0)
    return np.exp(-since_s / lag_s) if lag_s > 0 else np.zeros_like(since_s)


def _area(asked: Array, state: Array, since_s: Array, lag_s: float) -> Array:
    left = lag_s * (1 - _decay(since_s, lag_s))
    return asked * since_s[:, None] + (state - asked) * left[:, None]


def _moment(asked: Array, state: Array, since_s: Array, lag_s: float) -> Array:
    left = lag_s * (since_s - lag_s * (1 - _decay(since_s, lag_s)))
    return asked * (since_s**2 / 2)[:, None] + (state - asked) * left[:, None]
