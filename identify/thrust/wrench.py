"""Wrench of a dive as a function of time, from the thruster commands (through curve, lag and geometry; commands in
newtons need no curve) or from TAU_CMD.

Slow samples of quick commands are taken to change evenly from each sample to the next, pulses as pulses. The difference
from the true commands is modelled as a white force.
"""

from dataclasses import replace
from typing import Literal

import numpy as np

from bridge.arrays import Array
from bridge.errors import FitError
from bridge.vehicle.coefficients import DOFS
from bridge.vehicle.config import Configuration, ThrustCurve, VehicleFile
from bridge.vehicle.thrusters import allocation_matrix, thrust_curve
from identify.dive import TIMED_S, Dive, Reckoned, Signal
from identify.ingest.commands import sampled_seldom, unknown_between
from identify.thrust.pwm_rounding import hidden_by_rounding, thrust_slope, unrounded_by_run
from identify.thrust.wrench_history import (
    BETWEEN,
    WrenchHistory,
    evenly_between,
    halfway_between,
    history_of,
    is_jump,
)

NOTABLE_DIFFERENCE = 0.05
LEAST_WRENCH = 1e-3

PULSES_IN = "MAVLink's SERVO_OUTPUT_RAW or ACTUATOR_OUTPUT_STATUS, or columns that a map names"
"""Where a recording has the pulses of its thrusters, in words for those who record it."""

AT_REST = 1e-9
"""Variance of a wrench, N2 or N2 m2, below which it is the rounding of numbers: the thrusters never pushed there."""

MOST_OBEYED_S, OBEYED_STEP_S = 0.1, 0.005
"""The longest time by which pulses may follow TAU_CMD and still be compared with it, and the step of the search."""


BY_FAR_US = 50.0
"""A pulse further than this from neutral lies beyond any thruster's dead zone."""

MOST_BELOW = 0.05
"""Share of the pulses of one-way thrusters that may change far below neutral: a controller asks for none of them."""


def wrench(dive: Dive, file: VehicleFile, configuration_name: str) -> WrenchHistory:
    """Return the wrench that the thrusters of a configuration made during a dive.

    The wrench comes from PWM if the recording has an output for every thruster, otherwise from TAU_CMD. Raises FitError
    if the recording has neither, or pulses at which the thrust curve gives no thrust; ConfigError for a thrust table
    that can't be read.
    """
    commanded = dive.tau_cmd if dive.tau_cmd is not None and len(dive.tau_cmd) else None
    from_pwm, notes = _asked_by_pwm(dive, file, configuration_name)
    curve, breaks_s = file.vehicle.thrust_curve, dive.breaks_s
    if from_pwm is not None and dive.thruster_commands is not None:
        if commanded is not None:
            notes += _said_of(from_pwm, commanded)
        variance = hidden_by_rounding(dive, file, configuration_name)
        held_s = 1.0 / max(from_pwm.rate_hz, 1e-3)
        rounded = variance.mean(axis=0) * held_s
        if unknown_between(dive, dive.thruster_commands):
            straight = evenly_between(from_pwm)
            bent = _bent_between(dive, file, configuration_name)
            between = Signal(straight.time_s, straight.value + bent)
            return _sampled(from_pwm, between, curve, "pwm", notes, rounded, breaks_s)
        likeliest = Signal(from_pwm.time_s, unrounded_by_run(from_pwm, variance, breaks_s))
        history = history_of(likeliest, curve, "pwm", notes, breaks_s)
        if dive.reckoned is not None:
            history = _of_reckoned(history, dive.reckoned, dive, file, configuration_name)
        return replace(history, hidden=np.sqrt(rounded + history.hidden**2))
    commanded_count = 0 if dive.thruster_commands is None else dive.thruster_commands.value.shape[1]
    count = len(file.vehicle.configurations[configuration_name].thrusters)
    if commanded is None and 0 < commanded_count < count:
        raise FitError(
            f"has commands of {commanded_count} thrusters, and the vehicle file has {count} in configuration "
            f"'{configuration_name}'; give the file of this vehicle, with its thrusters in the order of these commands",
            of=dive.source,
        )
    if commanded is None:
        raise FitError(
            "neither thruster commands that fit the vehicle nor wrenches are recorded; "
            f"record them ({PULSES_IN}), "
            "and check the vehicle file's thrusters",
            of=dive.source,
        )
    notes = (*notes, "The wrench is TAU_CMD as recorded.")
    if unknown_between(dive, commanded):
        return _sampled(commanded, evenly_between(commanded), curve, "tau_cmd", notes, np.zeros(6), breaks_s)
    return history_of(commanded, curve, "tau_cmd", notes, breaks_s)


def tells_thrusters(dive: Dive, configuration: Configuration) -> bool:
    """Whether a recording has an output for every thruster of a configuration, all of them numbers at some time."""
    commands, thrusters = dive.thruster_commands, len(configuration.thrusters)
    if commands is None or not len(commands) or not 0 < thrusters <= commands.value.shape[1]:
        return False
    return bool(np.isfinite(commands.value[:, :thrusters]).all(axis=1).any())


def asked_thrusts(dive: Dive, file: VehicleFile, configuration_name: str) -> Signal:
    """The thrust (n, k) in N that each thruster of a configuration is asked for; none where its command is unknown."""
    commands = dive.thruster_commands
    assert commands is not None
    value = commands.value[:, : len(file.vehicle.configurations[configuration_name].thrusters)]
    return Signal(commands.time_s, _thrust_n(dive, value, file))


def thrusts_between(dive: Dive, file: VehicleFile, configuration_name: str) -> Signal:
    """The thrust (n, k) in N that each thruster is asked for between slow samples of its command.

    Its pulse changes evenly, for mixers add up pulses, and the thrust curve bends the result. Where the pulses
    jump they do so at an unknown time, and the mean thrust is halfway.
    """
    straight = evenly_between(asked_thrusts(dive, file, configuration_name))
    if dive.pwm is None:
        return straight
    pulses = dive.pwm.value[:, : straight.value.shape[1]]
    sent = np.where(pulses > 0, pulses, file.vehicle.thrust_curve.neutral_us)
    bent = _thrust_n(dive, evenly_between(Signal(dive.pwm.time_s, sent)).value, file)
    jumps = np.append(np.repeat(is_jump(sent), BETWEEN), True)
    return Signal(straight.time_s, np.where(jumps[:, None], straight.value, bent))


def _bent_between(dive: Dive, file: VehicleFile, configuration_name: str) -> Array:
    """Wrench (n, 6) between slow samples of the commands, beyond that of thrust which changes evenly."""
    straight = evenly_between(asked_thrusts(dive, file, configuration_name))
    bent = thrusts_between(dive, file, configuration_name).value - straight.value
    return np.asarray(bent @ allocation_matrix(file.vehicle.configurations[configuration_name]).T)


def _thrust_n(dive: Dive, commands: Array, file: VehicleFile) -> Array:
    """Thrust (n, k) of the dive's commands (n, k): a pulse through the curve, and none for no pulse or no number."""
    if dive.pwm is None:
        return np.nan_to_num(commands)
    curve = thrust_curve(file.vehicle.thrust_curve, file.path.parent)
    return curve.thrust(np.where(commands > 0, commands, curve.neutral_us))


def _refuse_thrustless(dive: Dive, pulses_us: Array, file: VehicleFile) -> None:
    """Raise FitError if no pulse (n, k), far as they lie from neutral, gives any thrust by the vehicle's curve."""
    curve = thrust_curve(file.vehicle.thrust_curve, file.path.parent)
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


def _below_neutral(pulses_us: Array, curve: ThrustCurve) -> list[str]:
    """A note on pulses (n, k) of one-way thrusters that change far below neutral, where their curve gives no thrust."""
    sent = pulses_us[pulses_us > 0]
    below = sent[sent < curve.neutral_us - BY_FAR_US]
    if not curve.one_way or len(below) <= MOST_BELOW * len(sent) or np.ptp(below) <= BY_FAR_US:
        return []
    return [
        f"{100 * len(below) / len(sent):.0f} % of the pulses lie far below the vehicle file's neutral_us of "
        f"{curve.neutral_us:.0f}, and change there between {below.min():.0f} and {below.max():.0f} us: its one-way "
        "thrusters are taken to give no thrust at these. Check neutral_us."
    ]


def _sampled(
    asked: Signal,
    between: Signal,
    curve: ThrustCurve,
    source: Literal["pwm", "tau_cmd"],
    notes: tuple[str, ...],
    rounded: Array,
    breaks_s: Array,
) -> WrenchHistory:
    """Return the history for slow samples (n, 6), with the wrench between them.

    A change at an unknown time between two samples is wrong by its size times the root of a twelfth of the sample
    interval, per root of that interval; steady changes, of which each sample lies halfway between its neighbours, hide
    less (`_of_reckoned`). So much is hidden where the commands change: a step of the sticks hides more than minutes at
    rest.
    """
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
    history = history_of(between, curve, source, notes, breaks_s)
    return replace(
        history,
        hidden=hidden,
        hidden_power=by_mean,
        sampled_s=step_s,
        unknown_s=np.where(np.nanvar(asked.value, axis=0) > AT_REST, step_s, 0.0),
        stepped=history_of(halfway_between(asked), curve, source, (), breaks_s),
    )


def _of_reckoned(
    history: WrenchHistory, reckoned: Reckoned, dive: Dive, file: VehicleFile, configuration_name: str
) -> WrenchHistory:
    """The history with the unknown part of reckoned pulses between their samples.

    A sample missed from both neighbours by a variance v lies amid two steps of a walk of variance 2 v a step, and one
    such step hides a twelfth of that, times its length.
    """
    missed, straight = (
        _variance(dive, file, configuration_name, np.array(of_us2))
        for of_us2 in (reckoned.missed_us2, reckoned.straight_us2)
    )
    share = np.divide(missed, straight, out=np.zeros(6), where=straight > AT_REST)
    return replace(
        history,
        hidden=np.sqrt(np.maximum(missed, 0.0) * reckoned.step_s / 6.0),
        sampled_s=0.0 if reckoned.tells_timing else reckoned.unknown_s,
        unknown_s=np.where(share * reckoned.step_s > TIMED_S, reckoned.step_s, 0.0),
    )


def _variance(dive: Dive, file: VehicleFile, configuration_name: str, of_us2: Array) -> Array:
    """Variance (6,) of the wrench by a covariance (outputs, outputs) of the pulses."""
    assert dive.pwm is not None
    allocation = allocation_matrix(file.vehicle.configurations[configuration_name])
    count = allocation.shape[1]
    slope = thrust_slope(dive.pwm.value[:, :count], file)
    of_thrust = of_us2[:count, :count] * (slope.T @ slope) / len(slope)
    return np.asarray(np.einsum("ij,jk,ik->i", allocation, of_thrust, allocation))


def _asked_by_pwm(
    dive: Dive, file: VehicleFile, configuration_name: str
) -> tuple[Signal | None, tuple[str, ...]]:
    """Return the wrench that the outputs command, and notes about it; no wrench if the outputs don't fit the vehicle
    file, or are never numbers."""
    configuration = file.vehicle.configurations[configuration_name]
    thrusters = len(configuration.thrusters)
    commands = dive.thruster_commands
    if commands is None or len(commands) == 0:
        return None, ("Commands of single thrusters are not recorded.",)
    if thrusters == 0:
        return None, (f"The vehicle file names no thrusters for '{configuration_name}'.",)
    outputs = commands.value.shape[1]
    if outputs < thrusters:
        return None, (f"{outputs} thruster outputs are recorded, the vehicle file names {thrusters}.",)
    if not tells_thrusters(dive, configuration):
        return None, ("At no time are the commands of all thrusters numbers.",)
    asked = asked_thrusts(dive, file, configuration_name)
    notes = []
    if dive.pwm is not None:
        pulses_us = dive.pwm.value[:, :thrusters]
        if rows := int(np.count_nonzero((pulses_us <= 0).any(axis=1))):
            leave = "1 command leaves" if rows == 1 else f"{rows} commands leave"
            notes.append(f"{leave} a thruster without a pulse: taken to be at rest.")
        _refuse_thrustless(dive, pulses_us, file)
        notes += _below_neutral(pulses_us, file.vehicle.thrust_curve)
    return Signal(asked.time_s, asked.value @ allocation_matrix(configuration).T), tuple(notes)


def obeyed_after_s(asked: Signal, commanded: Signal) -> float:
    """How long after TAU_CMD the wrench from the pulses agrees with it best, s.

    A vehicle that makes its commands itself gives both one stamp. An autopilot that receives them over a link obeys
    later.
    """
    scale = np.sqrt(np.mean(commanded.value**2, axis=0))
    used = [dof for dof in (0, 1, 5) if scale[dof] > LEAST_WRENCH]
    if not used:
        return 0.0
    delays_s = np.arange(0.0, MOST_OBEYED_S + 0.5 * OBEYED_STEP_S, OBEYED_STEP_S)
    off = [
        float(np.sum((_rms_difference(asked, commanded, float(delay_s))[used] / scale[used]) ** 2))
        for delay_s in delays_s
    ]
    return float(delays_s[int(np.argmin(off))]) if np.isfinite(off).all() else 0.0


def _rms_difference(asked: Signal, commanded: Signal, delay_s: float) -> Array:
    held = asked.held_at(commanded.time_s + delay_s)
    difference = (held - commanded.value)[np.isfinite(held[:, 0])]
    rms: Array = np.sqrt(np.mean(difference**2, axis=0)) if len(difference) else np.full(6, np.nan)
    return rms


def _said_of(asked: Signal, commanded: Signal) -> tuple[str, ...]:
    delay_s = obeyed_after_s(asked, commanded)
    differs_rms = _rms_difference(asked, commanded, delay_s)
    scale = np.sqrt(np.mean(commanded.value**2, axis=0))
    later = f", {1e3 * delay_s:.0f} ms after it" if delay_s > 0 else ""
    notes = []
    for dof in (0, 1, 5):
        if scale[dof] > LEAST_WRENCH and differs_rms[dof] > NOTABLE_DIFFERENCE * scale[dof]:
            unit = "N" if dof < 3 else "N m"
            notes.append(
                f"In {DOFS[dof]} the wrench from PWM differs from TAU_CMD by {differs_rms[dof]:.2g} {unit} "
                f"rms of {scale[dof]:.2g} {unit}{later}; the one from PWM is used."
            )
    return tuple(notes)
