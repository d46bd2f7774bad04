"""Finds the silences in a recording: spans in which a sender went on sending and was not heard.

The input is arrival times, boot times and sequence numbers. A link that queues frames delivers them late, and nothing
is missing. A ground computer that stood still shows no gap by its own clock, although the sender's clock went on. So
a silence is measured by the sender's clock whenever its frames state the boot time. A sender that says little, or is
silent by design, goes on with the next sequence number each time it speaks: nothing of it is missing.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from bridge.arrays import Array

ROUND: Final = 256
"""Sequence numbers have 8 bits."""
LEAST_S: Final = 5.0
TIMES_USUAL: Final = 10.0
"""A silence is longer than both LEAST_S and this many times the usual spacing."""
BACK_S: Final = 2.0
"""A boot clock that ran back by more than this belongs to a sender that restarted."""
AROUND: Final = 5
"""Number of boot times on either side of a pause whose median counts: a single late frame changes nothing."""
MOST: Final = 1000
"""Only this many of the longest pauses are examined: a recording may claim any number of them."""

Rows = NDArray[np.int64]


@dataclass(frozen=True, slots=True)
class Silence:
    """A span of a sender's time that was not heard: its length, and the recording time at which it was last heard."""

    begins_s: float
    seconds: float


@dataclass(frozen=True, slots=True)
class Pause:
    """The step from the frame in `row` to the sender's next frame.

    `seconds` is measured by the sender's clock if `by_clock`, otherwise by arrival. `goes_on`: the next frame has the
    next sequence number. `anew`: the sender's clock ran back in between.
    """

    row: int
    begins_s: float
    seconds: float
    goes_on: bool
    by_clock: bool = False
    anew: bool = False


@dataclass
class Spacing:
    """Sum, and sum of squares, of the steps between frames that are no longer than LEAST_S."""

    seconds: float = 0.0
    squares: float = 0.0


def silences(arrival_s: Array, boot_s: Array, number: Rows) -> tuple[Silence, ...]:
    """Return the silences of one sender, whose frames (n,) are in the order of the recording.

    `arrival_s`: arrival times. `boot_s`: boot times that the frames state, NaN if they state none. `number`: sequence
    numbers.
    """
    steps_s = np.diff(arrival_s)
    short_s = steps_s[(steps_s > 0.0) & (steps_s <= LEAST_S)]
    spacing = Spacing(float(short_s.sum()), float(np.square(short_s).sum()))
    missed = unheard(pauses(arrival_s, boot_s, number), spacing)
    return tuple(Silence(pause.begins_s, pause.seconds) for pause in missed)


def unheard(pauses: Sequence[Pause], spacing: Spacing) -> list[Pause]:
    """Return the pauses in which a sender went on unheard; `spacing` is that of all other steps.

    One in 256 silences ends with the next sequence number by chance, so a single pause that does is no proof of a
    sender that is silent by design.
    """
    meant = [pause for pause in pauses if pause.goes_on]
    if len(meant) == 1 and spacing.seconds:
        meant = []
    total_s = spacing.seconds + sum(pause.seconds for pause in meant)
    squares = spacing.squares + sum(pause.seconds**2 for pause in meant)
    # The mean step at a random instant, not of a random frame: a burst of frames does not make a sender fast.
    least_s = max(LEAST_S, TIMES_USUAL * squares / total_s if total_s else 0.0)
    return [pause for pause in pauses if pause not in meant and pause.seconds > least_s]


def pauses(arrival_s: Array, boot_s: Array, number: Rows, least_s: float = LEAST_S) -> list[Pause]:
    """Find the steps between one sender's frames that exceed `least_s` by arrival, or LEAST_S by its own clock."""
    steps_s = np.diff(arrival_s)
    dated = np.flatnonzero(np.isfinite(boot_s))
    ahead_s = boot_s[dated] - arrival_s[dated]
    far = np.flatnonzero(steps_s > least_s)
    if len(far) > MOST:
        far = far[np.argsort(-steps_s[far], kind="stable")[:MOST]]
    rows = sorted({*far.tolist(), *_jumps(steps_s, dated, ahead_s, least_s)})
    made = []
    for place, row in enumerate(rows):
        first = rows[place - 1] if place else -1
        last = rows[place + 1] if place + 1 < len(rows) else len(arrival_s)
        at = int(np.searchsorted(dated, row, "right"))
        before = ahead_s[max(at - AROUND, np.searchsorted(dated, first, "right")) : at]
        after = ahead_s[at : min(at + AROUND, np.searchsorted(dated, last, "right"))]
        goes_on = int(number[row + 1] - number[row]) % ROUND == 1
        step_s, begins_s = float(steps_s[row]), float(arrival_s[row])
        if not len(before) or not len(after):
            made.append(Pause(row, begins_s, step_s, goes_on))
            continue
        seconds, anew = of_clocks(begins_s, step_s, float(np.median(before)), float(np.median(after)))
        if step_s > least_s or seconds > LEAST_S:
            made.append(Pause(row, begins_s, seconds, goes_on, by_clock=True, anew=anew))
    return made


def of_clocks(begins_s: float, step_s: float, before_s: float, after_s: float) -> tuple[float, bool]:
    """Return the seconds unheard in a step of `step_s` from `begins_s` on, and whether the sender restarted in it.

    `before_s` and `after_s`: how far its boot clock was ahead of the arrival clock before and after the step.
    """
    booted_s = begins_s + step_s + after_s
    if booted_s < begins_s + before_s - BACK_S:
        return max(0.0, min(step_s, booted_s)), True
    return max(0.0, step_s + after_s - before_s), False


def longest(silences: Iterable[Silence]) -> Silence | None:
    return max(silences, key=lambda silence: silence.seconds, default=None)


def way_to_mend(ring: bool) -> str:
    """Say how to get the missing frames. `ring`: the vehicle keeps a recording of its own."""
    if ring:
        return "`seatrial fetch` brings what the vehicle kept of it"
    return "another recording of the dive may have it, see `seatrial merge`"


def _jumps(steps_s: Array, stated: Rows, ahead_s: Array, least_s: float) -> list[int]:
    """Rows without a pause by arrival after which the boot clock advances by over LEAST_S more than the arrivals."""
    rows: list[int] = []
    further = np.flatnonzero(np.diff(ahead_s) > LEAST_S)
    if len(further) > MOST:  # two clocks alternate, and neither is evidence of a pause
        return rows
    for at in further.tolist():
        between = steps_s[stated[at] : stated[at + 1]]
        if between.max() <= least_s:
            rows.append(int(stated[at] + np.argmax(between)))
    return rows
