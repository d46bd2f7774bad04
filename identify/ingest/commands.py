"""Thruster commands that a recording holds as no number: the thruster did something, and nobody knows what.

For a moment it did what it was told before. Where it is unknown for longer, TAU_CMD stands in for the thrust (see
`identify.forces`); without that, what moved the vehicle is unknown, and only the longest part of the dive in which all
commands are known is used.

How a command was logged tells what is known between two messages. Where messages come as commands change, each holds
until the next. Where a quick loop's commands are sampled slowly, nobody knows when they changed in between.
"""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from identify.dive import Dive, Signal

HELD_S = 0.5
"""Between two known commands of a thruster: short beside the seconds in which a vehicle changes its speed."""

SLOW_HZ = 4.0
"""Commands that come as often hold until the next: a vehicle hardly moves before that."""

LONE_S = 2.0
"""Nobody samples so seldom: commands further apart are logged as they change, regular or not."""

CHANGED, REGULAR, OFF_BEAT = 0.95, 0.8, 0.15
"""Share of messages that change something where changes alone are logged; share of steps between messages that are a
multiple of the usual one where a clock sends them, and how far off, in such steps, they may be."""

FEWEST = 10
"""Fewer messages show no clock that sends them."""

SPREAD_HZ = 10.0

Span = tuple[float, float]


def logged_at_changes(commands: Signal) -> bool:
    """Whether commands (n, k) that come seldom were logged as they changed."""
    if len(commands) < 2 or commands.rate_hz >= SLOW_HZ:
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
    """Whether what was commanded between two messages is unknown."""
    return len(commands) >= FEWEST and commands.rate_hz < SLOW_HZ and not logged_at_changes(commands)


def spread(commands: Signal, end_s: float) -> Signal:
    """Commands that hold until the next, told as often as a log that repeats them would, up to the end of a dive."""
    ends_s = np.append(commands.time_s[1:], max(end_s, float(commands.time_s[-1])))
    times = np.maximum(np.ceil((ends_s - commands.time_s) * SPREAD_HZ - 1e-6).astype(np.int64), 1)
    of = np.repeat(np.arange(len(commands)), times)
    place = np.arange(len(of)) - np.repeat(np.cumsum(times) - times, times)
    time_s = commands.time_s[of] + place / SPREAD_HZ
    last = ends_s[-1:][ends_s[-1:] > time_s[-1]]
    return Signal(
        np.append(time_s, last), np.vstack([commands.value[of], commands.value[of[-1:]][: len(last)]])
    )


def with_spread_commands(dive: Dive) -> Dive:
    """The dive with commands that were logged only as they changed told throughout, with a note."""
    signals = {"pwm": dive.pwm, "tau_cmd": dive.tau_cmd}
    changed = {
        name: spread(one, dive.span_s[1])
        for name, one in signals.items()
        if one is not None and logged_at_changes(one)
    }
    if not changed:
        return dive
    note = "Thruster commands were logged as they changed: each is taken to hold until the next."
    return replace(
        dive,
        pwm=changed.get("pwm", dive.pwm),
        tau_cmd=changed.get("tau_cmd", dive.tau_cmd),
        notes=(*dive.notes, note),
    )


def held_commands(pwm: Signal) -> Signal:
    """The commands (n, thrusters) with the last known one where one is unknown for no longer than HELD_S."""
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
    """The dive as far as its thruster commands are known, with notes; only the first `thrusters` outputs count."""
    if dive.pwm is None or not len(dive.pwm):
        return dive
    counted = Signal(dive.pwm.time_s, dive.pwm.value[:, :thrusters])
    unknown = ~np.isfinite(counted.value)
    if not unknown.any():
        return dive
    held = held_commands(dive.pwm)
    lacks = ~np.isfinite(held.value[:, :thrusters])
    noted = replace(dive, pwm=held, notes=dive.notes + _told_of(unknown))
    if not lacks.any() or lacks.any(axis=1).all() or (dive.tau_cmd is not None and len(dive.tau_cmd)):
        return noted
    outputs = _named(np.asarray(lacks.any(axis=0)))
    start_s, end_s = _longest(held.time_s, np.asarray(lacks.any(axis=1)), dive.span_s)
    digits = 0 if dive.duration_s - (end_s - start_s) >= 1.0 else 2
    told = (
        f"Before its first number, or for more than {HELD_S:g} s, the command in {outputs} is unknown, and no TAU_CMD "
        "is recorded that tells the wrench meanwhile: only the longest part in which all are known is used, "
        f"{end_s - start_s:.{digits}f} s of {dive.duration_s:.{digits}f} s; check what sends the thruster commands."
    )
    return replace(noted.between(start_s, end_s), notes=(*noted.notes, told))


def _told_of(unknown: NDArray[np.bool_]) -> tuple[str, ...]:
    """Notes on commands (n, thrusters) that are no number: outputs that never are one, and others."""
    never = np.asarray(unknown.all(axis=0))
    notes = []
    if never.any():
        notes.append(f"{never_known(never).capitalize()}: what was asked of a thruster there is unknown.")
    rows = np.count_nonzero((unknown & ~never).any(axis=1))
    if rows:
        share = f"({percent(rows / len(unknown))} %)"
        what = f"1 thruster command {share} is" if rows == 1 else f"{rows} thruster commands {share} are"
        outputs = _named(np.asarray(unknown.any(axis=0) & ~never))
        notes.append(f"{what} no number in {outputs}: the command before holds for up to {HELD_S:g} s.")
    return tuple(notes)


def percent(share: float) -> str:
    """A share above 0 in percent, never as 0.0."""
    return f"{100 * share:.1f}" if share >= 5e-4 else "less than 0.1"


def never_known(never: NDArray[np.bool_]) -> str:
    """What outputs (n,) that are never a number come to: `output 2 is no number all the dive`."""
    return f"{_named(never)} {'is' if np.count_nonzero(never) == 1 else 'are'} no number all the dive"


def _named(which: NDArray[np.bool_]) -> str:
    """`output 2`, `outputs 2 and 5`: where (n,) is true, counted from 1."""
    numbers = [str(1 + i) for i in np.flatnonzero(which)]
    words = " and ".join(", ".join(part) for part in (numbers[:-1], numbers[-1:]) if part)
    return f"output{'s' if len(numbers) > 1 else ''} {words}"


def _longest(time_s: NDArray[np.float64], lacking: NDArray[np.bool_], span_s: Span) -> Span:
    """The longest part of a dive in which no command is lacking (n,); its end is beyond its last sample."""
    edges = np.flatnonzero(np.diff(~lacking, prepend=False, append=False))
    starts_s = time_s[edges[::2]]
    if not lacking[0]:
        starts_s[0] = span_s[0]
    ends_s = np.append(time_s, np.nextafter(span_s[1], np.inf))[edges[1::2]]
    longest = np.argmax(ends_s - starts_s)
    return float(starts_s[longest]), float(ends_s[longest])
