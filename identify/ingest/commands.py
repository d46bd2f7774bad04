"""Handles thruster commands by how they were recorded: unknown, seldom, or in a form that the vehicle has to tell.

Of a command that is not a number, the thruster's action is unknown. For up to HELD_S the last known command is assumed
to hold. If the command is unknown for longer, the force on the vehicle is unknown, and only the longest part of the
dive in which all commands are known is used. Where the command of an output is never known, TAU_CMD replaces the thrust
(see `identify.thrust`).

The way of logging decides what is known between two messages. If commands are logged as they change, each holds until
the next. If the commands of a fast loop are sampled slowly, it is unknown when they changed in between.
"""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from bridge.arrays import Array
from bridge.errors import LogError
from bridge.vehicle.config import VehicleFile
from bridge.vehicle.thrusters import thrust_by_shaft, thrust_curve
from identify.dive import Dive, Signal
from identify.words import listed

HELD_S = 0.5
"""Longest gap between two known commands that is bridged: short compared with the seconds in which the speed changes.
"""

SLOW_HZ = 12.0
"""Commands at this rate or faster hold until the next. Below it, half a step is a delay that shows: thrust of a fast
loop, sampled at 5 or 10 Hz and held, seems to act 50 to 20 ms before it is asked for."""

SELDOM_HZ = 4.0
"""Samples of commands below this rate tell no delay and no lag of the thrusters."""

LONE_S = 2.0
"""No logger samples at longer intervals: commands further apart are logged as they change, whether regular or not."""

CHANGED, REGULAR, OFF_BEAT = 0.95, 0.8, 0.15
"""Criteria of the way of logging.

CHANGED: least share of messages that change a value if only changes are logged. REGULAR: least share of steps between
messages that are a multiple of the usual step if a clock sends them. OFF_BEAT: tolerance of such a multiple, in usual
steps.
"""

FEWEST = 10
"""With fewer messages, a regular clock can't be recognised."""

SPREAD_HZ = 20.0

SAMPLES_HZ = 40.0
"""Pulses at this rate or faster are an autopilot's samples of its loop. Slower ones may be all that a loop gave."""

LOOP_SHIFT = 0.1
"""Standard error of a delay by samples of a faster loop, in steps between them: 0.04 to 0.14 of one in sound dives of
a simulated ArduSub 4.6 at 20, 10 and 4 Hz."""

Span = tuple[float, float]

MOST_EFFORT = 1.05
"""A command a little beyond full is a controller's that does not limit itself."""


def driven_outputs(time_s: Array, pwm_us: Array) -> Signal | None:
    """Pulse widths (n, outputs) up to the first output that is never driven; None if that is the first.

    An output that is never a number counts as used, unless the last output is never a number either: then unused
    outputs are written that way.
    """
    unknown = np.asarray(np.isnan(pwm_us).all(axis=0))
    idle = np.flatnonzero(~((pwm_us > 0).any(axis=0) | (unknown & ~unknown[-1])))
    width = int(idle[0]) if len(idle) else pwm_us.shape[1]
    return Signal(time_s, pwm_us[:, :width]) if width else None


def samples_of_a_loop(pulses: Signal | None, loop_s: float) -> Signal | None:
    """Pulses that an autopilot sends as samples of its loop's, dated as commands that hold until the next.

    `loop_s` is the loop's step, the least between two changes of its outputs.

    The change that a sample is the first to show came half of a step between two samples earlier on average, less half
    of the loop's own: held samples at 50 Hz of a simulated ArduSub 4.5.7 turned its body 9 ms late.
    """
    if pulses is None or pulses.rate_hz < SAMPLES_HZ:
        return pulses
    return Signal(pulses.time_s - 0.5 * max(1.0 / pulses.rate_hz - loop_s, 0.0), pulses.value)


def holding_of_a_loop(pulses: Signal | None, loop_hz: float) -> bool | None:
    """`Dive.commands_hold` of pulses that an autopilot sends as samples of its loop's; `loop_hz`: the rate of the loop
    as the recording states it, NaN if it does not.

    False at less than half that rate, and below SLOW_HZ at any, for no loop that levels a vehicle is that slow. Else
    None: the thrust may tell it, or `samples_of_a_loop` has dated them as commands that hold.
    """
    if pulses is None or pulses.rate_hz >= SAMPLES_HZ or sampled_seldom(pulses):
        return None
    return False if sampled_slowly(pulses) or 2.0 * pulses.rate_hz < loop_hz else None


def logged_at_changes(commands: Signal) -> bool:
    """Whether commands (n, k) at a low rate were logged as they changed."""
    if len(commands) < 2 or commands.rate_hz >= SELDOM_HZ:
        return False
    before, after = commands.value[:-1], commands.value[1:]
    same = (before == after) | (np.isnan(before) & np.isnan(after))
    if np.mean(~same.all(axis=1)) < CHANGED:
        return False
    steps = np.diff(commands.time_s) * commands.rate_hz
    multiple = np.maximum(np.round(steps), 1.0)
    regular = np.mean(np.abs(steps - multiple) < OFF_BEAT) >= REGULAR
    return bool(1.0 / commands.rate_hz > LONE_S or not regular)


def sampled_slowly(commands: Signal) -> bool:
    """Whether the commands between two messages are unknown, by their rate."""
    return len(commands) >= FEWEST and commands.rate_hz < SLOW_HZ and not logged_at_changes(commands)


def unknown_between(dive: Dive, commands: Signal) -> bool:
    """Whether the commands of a dive are unknown between two messages, as far as it is known how they were logged."""
    if dive.commands_hold is not None:
        return not dive.commands_hold
    return sampled_seldom(commands) if loop_is_recorded(dive) else sampled_slowly(commands)


def loop_is_recorded(dive: Dive) -> bool:
    """Whether the controller logs its demand each time: its wrench with the pulses, or the parts of the wrench."""
    pulses = dive.thruster_commands is not None and dive.tau_cmd is not None
    return pulses or dive.tau_pid is not None or dive.nu_fb is not None


def sampled_seldom(commands: Signal) -> bool:
    """Whether the commands between two messages are unknown for so long that they hide when the thrusters act."""
    return sampled_slowly(commands) and commands.rate_hz < SELDOM_HZ


def commands_of_unknown_loop(dive: Dive) -> Signal | None:
    """The commands of a dive if it can be found out, but is not known yet, whether each holds until the next; None
    otherwise."""
    commands = dive.thruster_commands if dive.thruster_commands is not None else dive.tau_cmd
    known = loop_is_recorded(dive) or dive.commands_hold is not None or dive.reckoned is not None
    return None if commands is None or known or sampled_seldom(commands) else commands


def holding_variance_s2(dive: Dive) -> float:
    """Variance of a delay of the thrust, s2, because of what is unknown between two commands.

    Commands of a faster loop act half a step earlier than the same commands that hold, and a delay takes that up where
    it is unknown which they are. Of samples for certain, the loop's answers in between still shift it by LOOP_SHIFT.
    """
    commands = commands_of_unknown_loop(dive)
    if commands is not None:
        return 1.0 / (12.0 * commands.rate_hz**2)
    samples = dive.thruster_commands
    return (LOOP_SHIFT / samples.rate_hz) ** 2 if samples is not None and dive.commands_hold is False else 0.0


def spread(commands: Signal, end_s: float) -> Signal:
    """Repeat commands that hold until the next, at the rate of a continuous log, up to the end of a dive."""
    ends_s = np.append(commands.time_s[1:], max(end_s, float(commands.time_s[-1])))
    times = np.maximum(np.ceil((ends_s - commands.time_s) * SPREAD_HZ - 1e-6).astype(np.int64), 1)
    source_rows = np.repeat(np.arange(len(commands)), times)
    place = np.arange(len(source_rows)) - np.repeat(np.cumsum(times) - times, times)
    time_s = commands.time_s[source_rows] + place / SPREAD_HZ
    last = ends_s[-1:][ends_s[-1:] > time_s[-1]]
    return Signal(
        np.append(time_s, last),
        np.vstack([commands.value[source_rows], commands.value[source_rows[-1:]][: len(last)]]),
    )


def with_spread_commands(dive: Dive) -> Dive:
    """The dive with commands that were logged as they changed repeated throughout, and a note."""
    signals = {"pwm": dive.pwm, "thrust_cmd": dive.thrust_cmd, "tau_cmd": dive.tau_cmd}
    changed = {
        name: spread(signal, dive.span_s[1])
        for name, signal in signals.items()
        if signal is not None and logged_at_changes(signal)
    }
    if not changed:
        return dive
    note = "Thruster commands were logged as they changed: each is taken to hold until the next."
    return replace(
        dive,
        pwm=changed.get("pwm", dive.pwm),
        thrust_cmd=changed.get("thrust_cmd", dive.thrust_cmd),
        tau_cmd=changed.get("tau_cmd", dive.tau_cmd),
        commands_hold=True,
        notes=(*dive.notes, note),
    )


def _held_commands(pwm: Signal) -> Signal:
    """The commands (n, thrusters), with gaps of at most HELD_S filled by the last known command."""
    value = pwm.value.copy()
    for column in value.T:
        known = np.flatnonzero(np.isfinite(column))
        if len(known) in (0, len(column)):
            continue
        ends_s = np.append(pwm.time_s[known[1:]], pwm.time_s[-1])
        held = ends_s - pwm.time_s[known] <= HELD_S
        before = np.searchsorted(known, np.arange(len(column)), side="right") - 1
        filled = np.flatnonzero((before >= 0) & held[before] & ~np.isfinite(column))
        column[filled] = column[known[before[filled]]]
    return Signal(pwm.time_s, value)


def with_known_commands(dive: Dive, thrusters: int | None = None) -> Dive:
    """The part of the dive with known thruster commands, and notes; only the first `thrusters` outputs count."""
    commands = dive.thruster_commands
    if commands is None or not len(commands):
        return dive
    counted = Signal(commands.time_s, commands.value[:, :thrusters])
    unknown = ~np.isfinite(counted.value)
    if not unknown.any():
        return dive
    held = _held_commands(commands)
    lacks = ~np.isfinite(held.value[:, :thrusters])
    noted = replace(dive, notes=dive.notes + _unknown_noted(unknown))
    noted = replace(noted, thrust_cmd=held) if dive.pwm is None else replace(noted, pwm=held)
    if not lacks.any() or lacks.any(axis=1).all():
        return noted
    outputs = _named(np.asarray(lacks.any(axis=0)))
    start_s, end_s = _longest(held.time_s, np.asarray(lacks.any(axis=1)), dive.span_s)
    digits = 0 if dive.duration_s - (end_s - start_s) >= 1.0 else 2
    note = (
        f"Before its first number, or for more than {HELD_S:g} s, the command in {outputs} is unknown: only the "
        f"longest part in which all are known is used, {end_s - start_s:.{digits}f} s of "
        f"{dive.duration_s:.{digits}f} s; check what sends the thruster commands."
    )
    return replace(noted.between(start_s, end_s), notes=(*noted.notes, note))


def _unknown_noted(unknown: NDArray[np.bool_]) -> tuple[str, ...]:
    """Notes on commands (n, thrusters) that are not a number: outputs that never are a number, and others."""
    never = np.asarray(unknown.all(axis=0))
    notes = []
    if never.any():
        are = "is" if np.count_nonzero(never) == 1 else "are"
        notes.append(
            f"{_named(never).capitalize()} {are} no number all the dive: what was asked of a thruster is unknown."
        )
    rows = np.count_nonzero((unknown & ~never).any(axis=1))
    if rows:
        share = f"({percent(rows / len(unknown))} %)"
        subject = f"1 thruster command {share} is" if rows == 1 else f"{rows} thruster commands {share} are"
        outputs = _named(np.asarray(unknown.any(axis=0) & ~never))
        notes.append(f"{subject} no number in {outputs}: the command before holds for up to {HELD_S:g} s.")
    return tuple(notes)


def percent(share: float) -> str:
    """A share above 0 in per cent, never written as 0.0."""
    return f"{100 * share:.1f}" if share >= 5e-4 else "less than 0.1"


def _named(which: NDArray[np.bool_]) -> str:
    """Text such as `output 2` or `outputs 2 and 5`: the outputs with a true entry in (n,), counted from 1."""
    numbers = [str(1 + i) for i in np.flatnonzero(which)]
    return f"output{'s' if len(numbers) > 1 else ''} {listed(numbers)}"


def _longest(time_s: NDArray[np.float64], lacking: NDArray[np.bool_], span_s: Span) -> Span:
    """The longest part of a dive in which no command is lacking (n,). Its end lies beyond its last sample."""
    edges = np.flatnonzero(np.diff(~lacking, prepend=False, append=False))
    starts_s = time_s[edges[::2]]
    if not lacking[0]:
        starts_s[0] = span_s[0]
    ends_s = np.append(time_s, np.nextafter(span_s[1], np.inf))[edges[1::2]]
    longest = np.argmax(ends_s - starts_s)
    return float(starts_s[longest]), float(ends_s[longest])


def with_pulses(dive: Dive, vehicle: VehicleFile) -> Dive:
    """The dive with pulses in place of commands from -1 to 1: 0 is neutral, 1 and -1 are the ends of the thrust curve.
    Where nothing but the shafts' speeds was recorded, it gets their thrust.

    Raises LogError for commands beyond that, ConfigError for a thrust table that can't be read.
    """
    effort = dive.effort
    if effort is None:
        return _with_thrust_of_shafts(dive, vehicle)
    largest = float(np.nanmax(np.abs(effort.value), initial=0.0))
    if largest > MOST_EFFORT:
        raise LogError(
            f"its normalised thruster commands reach {largest:.4g}, and they lie within -1 to 1; give "
            "them their unit in the column map, or a scale (0.01 for per cent)",
            dive.source,
        )
    curve = thrust_curve(vehicle.vehicle.thrust_curve, vehicle.path.parent)
    astern_us, ahead_us = curve.ends_us
    value = np.clip(effort.value, -1.0, 1.0)
    span_us = np.where(value < 0, curve.neutral_us - astern_us, ahead_us - curve.neutral_us)
    return replace(dive, pwm=Signal(effort.time_s, curve.neutral_us + value * span_us), effort=None)


def _with_thrust_of_shafts(dive: Dive, vehicle: VehicleFile) -> Dive:
    rpm = dive.rpm
    if rpm is None or dive.thruster_commands is not None or dive.tau_cmd is not None:
        return dive
    curve = vehicle.vehicle.thrust_curve
    lagging = f", and lag_s: 0, as a measured speed has no lag of {curve.lag_s:g} s" if curve.lag_s else ""
    note = (
        "No thruster command is recorded: the thrust is that of the shafts' speeds, by forward_n_s2 and reverse_n_s2 "
        f"of the vehicle file's thrust_curve; check these{lagging}."
    )
    thrust = Signal(rpm.time_s, thrust_by_shaft(curve, rpm.value))
    return replace(dive, thrust_cmd=thrust, notes=(*dive.notes, note))
