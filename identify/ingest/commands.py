"""Thruster commands that a recording holds as no number: the thruster did something, and nobody knows what.

For a moment it did what it was told before. Where it is unknown for longer, TAU_CMD stands in for the wrench (see
`identify.forces`); without that, what moved the vehicle is unknown, and only the longest part of the dive in which all
commands are known is used.
"""

from dataclasses import replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from identify.dive import Dive, Signal

HELD_S = 0.5
"""Between two known commands of a thruster: short beside the seconds in which a vehicle changes its speed."""

Span = tuple[float, float]


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
    lacking = np.asarray(~np.isfinite(held.value[:, :thrusters]).all(axis=1))
    outputs = _named(unknown)
    rows = np.count_nonzero(unknown.any(axis=1))
    told = (
        f"{rows} thruster commands ({100 * rows / len(counted):.1f} %) are no number in {outputs}: the command before "
        f"holds for up to {HELD_S:g} s."
    )
    noted = replace(dive, pwm=held, notes=(*dive.notes, told))
    if not lacking.any() or (dive.tau_cmd is not None and len(dive.tau_cmd)):
        return noted
    start_s, end_s = _longest(held.time_s, lacking, dive.span_s)
    told = (
        f"A thruster's command is unknown for longer, and no TAU_CMD is recorded that tells the wrench meanwhile: only "
        f"the longest part in which all are known is used, {end_s - start_s:.0f} s of {dive.duration_s:.0f} s; check "
        "what sends the thruster commands."
    )
    return replace(noted.between(start_s, end_s), notes=(*noted.notes, told))


def _named(unknown: NDArray[np.bool_]) -> str:
    """`output 2`, `outputs 2 and 5`: the columns in which anything is unknown."""
    numbers = [str(1 + i) for i in np.flatnonzero(unknown.any(axis=0))]
    words = " and ".join(", ".join(part) for part in (numbers[:-1], numbers[-1:]) if part)
    return f"output{'s' if len(numbers) > 1 else ''} {words}"


def _longest(time_s: NDArray[np.float64], lacking: NDArray[np.bool_], span_s: Span) -> Span:
    """The longest part of a dive between commands that are lacking (n,); its end is beyond its last sample."""
    marks = [span_s[0], *time_s[lacking].tolist(), float(np.nextafter(span_s[1], np.inf))]
    # A part that begins with a lacking command begins at the known one after it.
    return max(pairwise(marks), key=lambda part: part[1] - part[0])
