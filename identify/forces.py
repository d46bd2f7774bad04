"""Wrench of a dive as a function of time, from the thruster commands (through curve, lag and geometry; commands in
newtons need no curve) or from TAU_CMD.

A command holds from its own time to the next command's. All thrusters share one first-order lag, so the lag acts on
the wrench: between two commands the wrench is W + (w - W) exp(-s / lag), with W the commanded wrench, w the wrench at
the command and s the time since the command. This is exact, and so is its integral.

Slow samples of quick commands are taken to change evenly from each sample to the next. The difference from the true
commands is modelled as a white force.
"""

from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import pairwise
from pathlib import Path
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from bridge.arrays import Array
from bridge.errors import FitError
from bridge.vehicle.coefficients import DOFS
from bridge.vehicle.config import CONFIGS, Configuration, ThrustCurve, Vehicle, VehicleFile
from bridge.vehicle.thrusters import allocation_matrix, thrust_curve
from identify.dive import Dive, Signal
from identify.ingest.commands import held_commands, never_known, sampled_seldom, unknown_between
from identify.statistics import bulk_std

NOTABLE_DIFFERENCE = 0.05
LEAST_WRENCH = 1e-3

BETWEEN = 8
"""Steps between two slow samples."""

FAR = 6.0
"""A change of the wrench by more than this many standard deviations of rounding is not rounding."""

BY_FAR_US = 50.0
"""A pulse further than this from neutral lies beyond any thruster's dead zone."""

MOST_BELOW = 0.05
"""Share of the pulses of one-way thrusters that may change far below neutral: a controller asks for none of them."""

LAST = 9
"""Number of commands whose median is the level: half a second of a stock autopilot's log."""


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
    commands, 0 if the commands are known at all times. `breaks_s` (r - 1,): times between the runs of a dive; before
    the first command of each run the wrench is constant.
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


def wrench(dive: Dive, vehicle: Vehicle | VehicleFile, configuration_name: str) -> WrenchHistory:
    """Return the wrench that the thrusters of a configuration made during a dive.

    The wrench comes from PWM if the recording has an output for every thruster, otherwise from TAU_CMD. A thrust
    table next to the vehicle file is found only if `vehicle` is a VehicleFile. Raises FitError if the recording has
    neither, or pulses at which the thrust curve gives no thrust; ConfigError for a thrust table that can't be read.
    """
    if isinstance(vehicle, VehicleFile):
        directory, vehicle = vehicle.path.parent, vehicle.vehicle
    else:
        directory = CONFIGS / "thrusters"
    commanded = dive.tau_cmd if dive.tau_cmd is not None and len(dive.tau_cmd) else None
    from_pwm, notes = _asked_by_pwm(dive, vehicle, directory, configuration_name, commanded)
    curve, breaks_s = vehicle.thrust_curve, dive.breaks_s
    if from_pwm is not None and dive.thruster_commands is not None:
        if commanded is not None:
            notes += _said_of(_rms_difference(from_pwm, commanded), commanded)
        variance = _hidden(dive, vehicle, directory, configuration_name)
        held_s = 1.0 / max(from_pwm.rate_hz, 1e-3)
        rounded = variance.mean(axis=0) * held_s
        if unknown_between(dive, dive.thruster_commands):
            return _sampled(from_pwm, curve, "pwm", notes, rounded, breaks_s)
        likeliest = Signal(from_pwm.time_s, _unrounded(from_pwm, variance, breaks_s))
        history = _history(likeliest, curve, "pwm", notes, breaks_s)
        hidden = np.sqrt(rounded + _reckoned(dive, vehicle, directory, configuration_name))
        reckoned = dive.reckoned
        unknown_s = reckoned.unknown_s if reckoned is not None and not reckoned.tells_timing else 0.0
        return replace(history, hidden=hidden, sampled_s=unknown_s)
    commanded_count = 0 if dive.thruster_commands is None else dive.thruster_commands.value.shape[1]
    count = len(vehicle.configurations[configuration_name].thrusters)
    if commanded is None and 0 < commanded_count < count:
        raise FitError(
            f"has commands of {commanded_count} thrusters, and the vehicle file has {count} in configuration "
            f"'{configuration_name}'; give the file of this vehicle, with its thrusters in the order of these commands",
            of=dive.source,
        )
    if commanded is None:
        raise FitError(
            "neither thruster commands that fit the vehicle nor wrenches are recorded; "
            "record SERVO_OUTPUT_RAW or ACTUATOR_OUTPUT_STATUS, and check the vehicle file's thrusters",
            of=dive.source,
        )
    notes = (*notes, "The wrench is TAU_CMD as recorded.")
    if unknown_between(dive, commanded):
        return _sampled(commanded, curve, "tau_cmd", notes, np.zeros(6), breaks_s)
    return _history(commanded, curve, "tau_cmd", notes, breaks_s)


def tells_thrusters(dive: Dive, configuration: Configuration) -> bool:
    """Whether a recording has an output for every thruster of a configuration."""
    commands = dive.thruster_commands
    outputs = 0 if commands is None or not len(commands) else commands.value.shape[1]
    return 0 < len(configuration.thrusters) <= outputs


def asked_thrusts(dive: Dive, file: VehicleFile, configuration_name: str) -> Signal:
    """The thrust (n, k) in N that each thruster of a configuration is asked for; none where its command is unknown."""
    commands = dive.thruster_commands
    assert commands is not None
    value = commands.value[:, : len(file.vehicle.configurations[configuration_name].thrusters)]
    return Signal(commands.time_s, _thrust_n(dive, value, file.vehicle, file.path.parent))


def _thrust_n(dive: Dive, commands: Array, vehicle: Vehicle, directory: Path) -> Array:
    """Thrust (n, k) of the dive's commands (n, k): a pulse through the curve, and none for no pulse or no number."""
    if dive.pwm is None:
        return np.nan_to_num(commands)
    curve = thrust_curve(vehicle.thrust_curve, directory)
    return curve.thrust(np.where(commands > 0, commands, curve.neutral_us))


def _refuse_thrustless(dive: Dive, pulses_us: Array, vehicle: Vehicle, directory: Path) -> None:
    """Raise FitError if no pulse (n, k), far as they lie from neutral, gives any thrust by the vehicle's curve."""
    curve = thrust_curve(vehicle.thrust_curve, directory)
    sent = pulses_us[pulses_us > 0]
    if not (np.abs(sent - curve.neutral_us) > BY_FAR_US).any() or curve.thrust(sent).any():
        return
    low_us, high_us = curve.ends_us
    raise FitError(
        f"the vehicle file's thrust curve gives no thrust at any recorded pulse: these lie between {sent.min():.0f} "
        f"and {sent.max():.0f} us, and the curve goes from {low_us:.0f} to {high_us:.0f} us with its neutral at "
        f"{curve.neutral_us:.0f} us; mend thrust_curve: neutral_us, or the unit of the commands",
        of=dive.source,
    )


def _below_neutral(pulses_us: Array, vehicle: Vehicle) -> list[str]:
    """A note on pulses (n, k) of one-way thrusters that change far below neutral, where their curve gives no thrust."""
    curve = vehicle.thrust_curve
    sent = pulses_us[pulses_us > 0]
    below = sent[sent < curve.neutral_us - BY_FAR_US]
    if not curve.one_way or len(below) <= MOST_BELOW * len(sent) or np.ptp(below) <= BY_FAR_US:
        return []
    return [
        f"{100 * len(below) / len(sent):.0f} % of the pulses lie far below the vehicle file's neutral_us of "
        f"{curve.neutral_us:.0f}, and change there between {below.min():.0f} and {below.max():.0f} us: its one-way "
        "thrusters are taken to give no thrust at these. Check neutral_us."
    ]


def evenly_between(samples: Signal) -> Signal:
    """Return slow samples with BETWEEN even steps from each sample to the next."""
    at = np.arange(BETWEEN * (len(samples) - 1) + 1) / BETWEEN
    number = np.arange(len(samples))
    # A step holds until the next step, so its middle lies half a step later.
    value = [np.interp(at + 0.5 / BETWEEN, number, column) for column in samples.value.T]
    return Signal(np.interp(at, number, samples.time_s), np.column_stack(value))


def _sampled(
    asked: Signal,
    curve: ThrustCurve,
    source: Literal["pwm", "tau_cmd"],
    notes: tuple[str, ...],
    rounded: Array,
    breaks_s: Array,
) -> WrenchHistory:
    """Return the history for slow samples. A change at an unknown time between two samples is wrong by its size times
    the root of a twelfth of the sample interval, per root of that interval; steady changes, of which each sample lies
    halfway between its neighbours, hide less (`_reckoned`). So much is hidden where the commands change: a step of the
    sticks hides more than minutes at rest."""
    step_s = 1.0 / asked.rate_hz
    changes = np.diff(asked.value, axis=0)
    beyond = 0.5 * np.diff(changes, axis=0, prepend=changes[:1], append=changes[-1:])
    of_steady = beyond[1:] ** 2 + beyond[:-1] ** 2
    less = np.nanmean(of_steady, axis=0) < np.nanmean(changes**2, axis=0)
    power = rounded + np.nan_to_num(np.where(less, of_steady, changes**2)) * step_s / 12.0
    mean = power.mean(axis=0)
    hidden = np.sqrt(mean)
    by_mean = np.where(mean > 0, power / np.where(mean > 0, mean, 1.0), 1.0)
    if sampled_seldom(asked):
        note = (
            f"Thruster commands are known every {step_s:.2g} s alone: a delay or a lag of the thrusters can't be "
            "judged; record them at 10 Hz or more for that."
        )
        notes = (*notes, note)
    history = _history(evenly_between(asked), curve, source, notes, breaks_s)
    return replace(history, hidden=hidden, hidden_power=by_mean, sampled_s=step_s)


def unrounded_thrusts(asked: Signal, dive: Dive, file: VehicleFile, configuration_name: str) -> Signal:
    """Return each thruster's commanded thrust (n, k), corrected by the smallest change that gives the most likely
    wrench behind the rounded wrench (`unrounded`)."""
    variance = _hidden(dive, file.vehicle, file.path.parent, configuration_name)
    allocation = allocation_matrix(file.vehicle.configurations[configuration_name])
    rounded = Signal(asked.time_s, asked.value @ allocation.T)
    change = _unrounded(rounded, variance, dive.breaks_s) - rounded.value
    return Signal(asked.time_s, asked.value + change @ np.linalg.pinv(allocation).T)


def _hidden(dive: Dive, vehicle: Vehicle, directory: Path, configuration_name: str) -> Array:
    """Variance (n, 6) of the part of each command's wrench that rounding to whole microseconds hides. Zero if the
    commanded wrench is recorded too, because the readings that it responds to are then recorded as well."""
    commands = dive.thruster_commands
    if dive.pwm is None or (dive.tau_cmd is not None and len(dive.tau_cmd)):
        return np.zeros((0 if commands is None else len(commands), 6))
    return _rounding(dive.pwm, vehicle, directory, configuration_name)


def _rounding(pwm: Signal, vehicle: Vehicle, directory: Path, configuration_name: str) -> Array:
    """Variance (n, 6) of the part of each command's wrench that rounding hides: a uniform error of one microsecond
    through the slope of the thrust curve. Zero if pulses are not rounded."""
    configuration = vehicle.configurations[configuration_name]
    pulses = pwm.value[:, : len(configuration.thrusters)]
    known = np.isfinite(pulses)
    if len(pwm) < 2 or not np.array_equal(pulses[known], np.round(pulses[known])):
        return np.zeros((len(pwm), 6))
    slope = _slope(pulses, vehicle, directory)
    return np.asarray(slope**2 / 12.0 @ (allocation_matrix(configuration) ** 2).T)


def _reckoned(dive: Dive, vehicle: Vehicle, directory: Path, configuration_name: str) -> Array:
    """Power (6,) per 1/s of the force that reckoned pulses miss between their samples; 0 of recorded ones.

    A sample missed from both neighbours by a variance v lies amid two steps of a walk of variance 2 v a step, and one
    such step hides a twelfth of that, times its length.
    """
    if dive.reckoned is None or dive.pwm is None:
        return np.zeros(6)
    configuration = vehicle.configurations[configuration_name]
    count = len(configuration.thrusters)
    slope = _slope(dive.pwm.value[:, :count], vehicle, directory)
    variance = (slope * np.array(dive.reckoned.error_us[:count])) ** 2 @ (
        allocation_matrix(configuration) ** 2
    ).T
    return np.asarray(variance.mean(axis=0) * dive.reckoned.step_s / 6.0)


def _slope(pulses_us: Array, vehicle: Vehicle, directory: Path) -> Array:
    """Slope (n, k) of the thrust curve at pulses (n, k), N per us; at rest for no pulse or no number."""
    curve = thrust_curve(vehicle.thrust_curve, directory)
    sent = np.where(np.isfinite(pulses_us) & (pulses_us > 0), pulses_us, curve.neutral_us)
    return np.asarray(0.5 * (curve.thrust(sent + 1.0) - curve.thrust(sent - 1.0)))


def _unrounded(asked: Signal, variance: Array, breaks_s: Array) -> Array:
    """`unrounded` wrenches (n, 6), run by run."""
    at = np.searchsorted(asked.time_s, breaks_s)
    runs = zip(np.split(asked.value, at), np.split(variance, at), strict=True)
    return np.vstack([unrounded(wrenches, hidden) for wrenches, hidden in runs if len(wrenches)])


def unrounded(asked: Array, variance: Array) -> Array:
    """Return the most likely wrench (n, 6) behind a rounded wrench, given the variance (n, 6) of the rounding.

    A recorded force that is partly rounding is an error in a regressor, and makes the mass too large (Fuller 1987,
    section 1.1). The deviation of a command from the median of the last LAST commands is shrunk by the share of its
    spread that exceeds the spread of rounding (Wiener 1949), and kept whole if it is far larger than rounding ever
    is. Later commands are not used: they respond to readings that are yet to be explained.
    """
    out = asked.copy()
    for column in np.flatnonzero(variance.any(axis=0)).tolist():
        recorded, hidden = asked[:, column], float(np.mean(variance[:, column]))
        past = np.lib.stride_tricks.sliding_window_view(np.pad(recorded, (LAST - 1, 0), mode="edge"), LAST)
        level = np.median(past, axis=1)
        beyond = recorded - level
        spread = bulk_std(beyond) ** 2
        believed = 1.0 - hidden / max(spread, hidden)
        small = 1.0 - hidden / np.maximum(beyond**2, hidden)
        share = np.where(beyond**2 > FAR**2 * hidden, 1.0, np.maximum(believed, small))
        out[:, column] = level + share * beyond
    return out


def _asked_by_pwm(
    dive: Dive, vehicle: Vehicle, directory: Path, configuration_name: str, commanded: Signal | None
) -> tuple[Signal | None, tuple[str, ...]]:
    """Return the wrench that the outputs command, and notes about it; no wrench if the outputs don't fit the vehicle
    file.

    A command that is not a number takes the value of the command before it. If it stays unknown for longer than a
    command holds, the wrench is TAU_CMD, if recorded. Raises FitError if a command is unknown throughout the dive and
    no TAU_CMD is recorded.
    """
    configuration = vehicle.configurations[configuration_name]
    thrusters = len(configuration.thrusters)
    commands = dive.thruster_commands
    if commands is None or len(commands) == 0:
        return None, ("No thruster commands are recorded.",)
    if thrusters == 0:
        return None, (f"The vehicle file names no thrusters for '{configuration_name}'.",)
    outputs = commands.value.shape[1]
    if outputs < thrusters:
        return None, (f"{outputs} thruster outputs are recorded, the vehicle file names {thrusters}.",)
    time_s = commands.time_s
    held = held_commands(Signal(time_s, commands.value[:, :thrusters])).value
    notes = []
    unknown = ~np.isfinite(held)
    silent: NDArray[np.bool_] = ~unknown & (held <= 0) & (dive.pwm is not None)
    if silent.any():
        rows = int(np.count_nonzero(silent.any(axis=1)))
        notes.append(f"{_commands(rows, 'leave')} a thruster without a pulse: taken to be at rest.")
    if dive.pwm is not None:
        _refuse_thrustless(dive, held, vehicle, directory)
        notes += _below_neutral(held, vehicle)
    asked: Array = _thrust_n(dive, held, vehicle, directory) @ allocation_matrix(configuration).T
    if commanded is None and unknown.any(axis=1).all():
        never = np.asarray(unknown.all(axis=0))
        reason = never_known(never) if never.any() else "at no time are those of all thrusters numbers"
        raise FitError(
            f"the recorded thruster commands tell no wrench, as {reason}; check what sends them, or "
            "record TAU_CMD",
            of=dive.source,
        )
    if unknown.any():
        stands_in = np.full(asked.shape, np.nan) if commanded is None else commanded.held_at(time_s)
        by_controller = np.asarray(unknown.any(axis=1) & np.isfinite(stands_in).all(axis=1))
        at_rest = unknown.any(axis=1) & ~by_controller
        asked = np.where(by_controller[:, None], stands_in, asked)
        notes += [
            f"{_commands(count, 'lack')} a thruster for longer than it holds: {reason}."
            for count, reason in (
                (int(by_controller.sum()), "the wrench is TAU_CMD there"),
                (int(at_rest.sum()), "it is taken to be at rest there"),
            )
            if count
        ]
    return Signal(time_s, asked), tuple(notes)


def _commands(count: int, verb: str) -> str:
    return f"1 command {verb}s" if count == 1 else f"{count} commands {verb}"


def _history(
    asked: Signal,
    curve: ThrustCurve,
    source: Literal["pwm", "tau_cmd"],
    notes: tuple[str, ...],
    breaks_s: Array,
) -> WrenchHistory:
    asked, lag_s = Signal(asked.time_s + curve.delay_s, asked.value), curve.lag_s
    step_s = np.diff(asked.time_s)
    decay = _decay(step_s, lag_s)
    runs = np.split(np.arange(len(asked)), np.searchsorted(asked.time_s, breaks_s))
    state = np.vstack([_lagged(asked.value[run], decay[run[:-1]]) for run in runs if len(run)])
    areas = _area(asked.value[:-1], state[:-1], step_s, lag_s)
    integral = np.concatenate((np.zeros((1, 6)), np.cumsum(areas, axis=0)))
    moments = integral[:-1] * step_s[:, None] + _moment(asked.value[:-1], state[:-1], step_s, lag_s)
    moment = np.concatenate((np.zeros((1, 6)), np.cumsum(moments, axis=0)))
    return WrenchHistory(
        asked.time_s, asked.value, state, integral, moment, lag_s, source, notes, breaks_s=breaks_s
    )


def _lagged(asked: Array, decay: Array) -> Array:
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


def _rms_difference(from_pwm: Signal, commanded: Signal) -> Array:
    held = from_pwm.held_at(commanded.time_s)
    difference = (held - commanded.value)[np.isfinite(held[:, 0])]
    rms: Array = np.sqrt(np.mean(difference**2, axis=0)) if len(difference) else np.full(6, np.nan)
    return rms


def _said_of(differs_rms: Array, commanded: Signal) -> tuple[str, ...]:
    scale = np.sqrt(np.mean(commanded.value**2, axis=0))
    notes = []
    for dof in (0, 1, 5):
        if scale[dof] > LEAST_WRENCH and differs_rms[dof] > NOTABLE_DIFFERENCE * scale[dof]:
            unit = "N" if dof < 3 else "N m"
            notes.append(
                f"In {DOFS[dof]} the wrench from PWM differs from TAU_CMD by {differs_rms[dof]:.2g} {unit} "
                f"rms of {scale[dof]:.2g} {unit}; the one from PWM is used."
            )
    return tuple(notes)
