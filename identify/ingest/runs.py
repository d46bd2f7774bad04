"""Chooses the run to use of a recording in which the vehicle restarted: the run with the longest thruster activity.

The longest run may be the time that the vehicle lay afloat after its dive.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from typing import Final

import numpy as np

from bridge.arrays import Array
from bridge.vehicle.thrusters import NEUTRAL_US
from identify.dive import Kind, Note, Signal

BEYOND_US: Final = 20.0
PULSE_US: Final = (800.0, 2200.0)
HELD_S: Final = 1.0
"""Longest time for which a command counts, even if the next comes later."""
MOST_LISTED: Final = 4


@dataclass(frozen=True)
class Run:
    """A run: Unix time of its first arrival, its length, and how long the thrusters were commanded while armed."""

    began_unix_s: float
    span_s: float
    driven_s: float


def driven_s(pwm: Signal | None, tau_cmd: Signal | None, armed: Signal | None) -> float:
    """Seconds in which the vehicle was armed and its thrusters were commanded beyond neutral; 0 without commands.

    `pwm` in us, compared with each output's value while disarmed; `tau_cmd` is used if `pwm` is None. `armed` None
    counts as armed.
    """
    commands = pwm if pwm is not None else tau_cmd
    if commands is None or len(commands) == 0:
        return 0.0
    on = np.ones(len(commands), np.bool_)
    if armed is not None and len(armed):
        last = np.searchsorted(armed.time_s, commands.time_s, side="right") - 1
        on = np.asarray(armed.value[np.maximum(last, 0), 0] > 0)
    if pwm is not None:
        inside = (pwm.value >= PULSE_US[0]) & (pwm.value <= PULSE_US[1])
        beyond = inside & (np.abs(pwm.value - _neutral_us(pwm.value[~on])) > BEYOND_US)
    else:
        beyond = np.abs(commands.value) > 0
    lasts_s = np.minimum(np.diff(commands.time_s, append=commands.time_s[-1]), HELD_S)
    return float(lasts_s[on & beyond.any(axis=1)].sum())


def _neutral_us(disarmed_us: Array) -> Array:
    """Median of each output while disarmed (n, k), as (k,); 1500 for an output that sent no pulse."""
    if len(disarmed_us) == 0:
        return np.full(disarmed_us.shape[1], NEUTRAL_US)
    usual = np.median(np.nan_to_num(disarmed_us), axis=0)
    return np.where((usual >= PULSE_US[0]) & (usual <= PULSE_US[1]), usual, NEUTRAL_US)


def chosen(runs: Sequence[Run]) -> tuple[int, tuple[str, ...]]:
    """Index of the run to use, and a note on it if there are several."""
    best = max(range(len(runs)), key=lambda i: (runs[i].driven_s, runs[i].span_s))
    if len(runs) == 1:
        return 0, ()
    used, other_spans = runs[best], sorted((r.span_s for i, r in enumerate(runs) if i != best), reverse=True)
    why = (
        f"its thrusters moved it the most, for {used.driven_s:.0f} s"
        if used.driven_s
        else "it is the longest"
    )
    span_words = ", ".join(f"{span_s:.0f} s" for span_s in other_spans[:MOST_LISTED])
    more = f" and {len(other_spans) - MOST_LISTED} shorter" if len(other_spans) > MOST_LISTED else ""
    subject = "the other lasts" if len(other_spans) == 1 else "the others last"
    times = f"{len(other_spans)} time{'s' if len(other_spans) > 1 else ''}"
    return best, (
        Note(
            f"The vehicle restarted {times} during the recording; of {len(runs)} runs the one that began at "
            f"{_clock(used.began_unix_s)} UTC, {used.span_s:.0f} s, is used ({why}); {subject} {span_words}{more}.",
            Kind.RESTART,
        ),
    )


def _clock(unix_s: float) -> str:
    try:
        return f"{datetime.fromtimestamp(unix_s, UTC):%H:%M}"
    except (ValueError, OverflowError, OSError):
        return "an unknown time"
