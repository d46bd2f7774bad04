"""What was not heard of a sender that went on meanwhile: the silences of a recording, by its times and boot times.

A link that queues brings late what was sent, and nothing is missing; a ground that stood still has no gap of its own,
though its sender's clock went on. So a silence counts by the sender's own clock wherever that is told. One that says
little, or is silent by design, goes on with its next number each time it speaks: nothing of it is missing.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

ROUND: Final = 256
"""A sequence number has 8 bits."""
LEAST_S: Final = 5.0
TIMES_USUAL: Final = 10.0
"""A silence is longer than both: so many seconds, and so many times the usual spacing."""
BACK_S: Final = 2.0
"""A boot clock that ran back by more belongs to a sender that started anew."""
AROUND: Final = 5
"""Boot times on either side of a pause of which the middle one counts: one frame that came late changes nothing."""
MOST: Final = 1000
"""Pauses that are looked at, the longest: a recording may claim any number of them."""

Array = NDArray[np.float64]
Rows = NDArray[np.int64]


@dataclass(frozen=True, slots=True)
class Silence:
    """`seconds` of a sender's time that were not heard; `begins_s`: when it was heard last, by the recording."""

    begins_s: float
    seconds: float


@dataclass(frozen=True, slots=True)
class Pause:
    """From the frame in `row` to the sender's next: `seconds` of its own time where `told` says that its clock told it.

    `goes_on` where the next frame bears the next number; `anew` where its clock ran back meanwhile.
    """

    row: int
    begins_s: float
    seconds: float
    goes_on: bool
    told: bool = False
    anew: bool = False


@dataclass
class Spacing:
    """How long the steps between frames are, LEAST_S at the most: their sum, and the sum of their squares."""

    seconds: float = 0.0
    squares: float = 0.0


def silences(arrival_s: Array, boot_s: Array, number: Rows) -> tuple[Silence, ...]:
    """Those of one sender's frames (n,) in the order of a recording: when each arrived, the boot time that it states,
    NaN for none, and its sequence number."""
    steps_s = np.diff(arrival_s)
    short_s = steps_s[(steps_s > 0.0) & (steps_s <= LEAST_S)]
    spacing = Spacing(float(short_s.sum()), float(np.square(short_s).sum()))
    found = unheard(pauses(arrival_s, boot_s, number), spacing)
    return tuple(Silence(pause.begins_s, pause.seconds) for pause in found)


def unheard(found: Sequence[Pause], spacing: Spacing) -> list[Pause]:
    """The pauses in which a sender went on unheard; `spacing` is that of all other steps.

    Of 256 silences one ends with the next number by chance: the only pause that does is no proof of a design.
    """
    meant = [pause for pause in found if pause.goes_on]
    if len(meant) == 1 and spacing.seconds:
        meant = []
    total_s = spacing.seconds + sum(pause.seconds for pause in meant)
    squares = spacing.squares + sum(pause.seconds**2 for pause in meant)
    # The mean step at a random instant, not of a random frame: many frames at once do not make a sender quick.
    least_s = max(LEAST_S, TIMES_USUAL * squares / total_s if total_s else 0.0)
    return [pause for pause in found if pause not in meant and pause.seconds > least_s]


def pauses(arrival_s: Array, boot_s: Array, number: Rows, least_s: float = LEAST_S) -> list[Pause]:
    """Where one sender's frames lie further apart than `least_s` by arrival, or LEAST_S by its own clock."""
    steps_s = np.diff(arrival_s)
    told = np.flatnonzero(np.isfinite(boot_s))
    ahead_s = boot_s[told] - arrival_s[told]
    far = np.flatnonzero(steps_s > least_s)
    if len(far) > MOST:
        far = far[np.argsort(-steps_s[far], kind="stable")[:MOST]]
    rows = sorted({*far.tolist(), *_jumps(steps_s, told, ahead_s, least_s)})
    made = []
    for place, row in enumerate(rows):
        first = rows[place - 1] if place else -1
        last = rows[place + 1] if place + 1 < len(rows) else len(arrival_s)
        at = int(np.searchsorted(told, row, "right"))
        before = ahead_s[max(at - AROUND, np.searchsorted(told, first, "right")) : at]
        after = ahead_s[at : min(at + AROUND, np.searchsorted(told, last, "right"))]
        goes_on = int(number[row + 1] - number[row]) % ROUND == 1
        step_s, begins_s = float(steps_s[row]), float(arrival_s[row])
        if not len(before) or not len(after):
            made.append(Pause(row, begins_s, step_s, goes_on))
            continue
        seconds, anew = of_clocks(begins_s, step_s, float(np.median(before)), float(np.median(after)))
        if step_s > least_s or seconds > LEAST_S:
            made.append(Pause(row, begins_s, seconds, goes_on, told=True, anew=anew))
    return made


def of_clocks(begins_s: float, step_s: float, before_s: float, after_s: float) -> tuple[float, bool]:
    """Seconds unheard over a step of `step_s` from `begins_s` on, and whether the sender started anew meanwhile.

    `before_s` and `after_s`: how far its boot clock was ahead of that of the arrivals.
    """
    booted_s = begins_s + step_s + after_s
    if booted_s < begins_s + before_s - BACK_S:
        return max(0.0, min(step_s, booted_s)), True
    return max(0.0, step_s + after_s - before_s), False


def longest(found: Iterable[Silence]) -> Silence | None:
    """None where there is none."""
    return max(found, key=lambda silence: silence.seconds, default=None)


def way_to_mend(ring: bool) -> str:
    """What brings the frames; `ring` where the vehicle keeps a recording of its own."""
    if ring:
        return "`seatrial fetch` brings what the vehicle kept of it"
    return "another recording of the dive may have it, see `seatrial merge`"


def _jumps(steps_s: Array, told: Rows, ahead_s: Array, least_s: float) -> list[int]:
    """Rows without a pause by arrival after which the boot clock has gone on by LEAST_S more."""
    rows: list[int] = []
    further = np.flatnonzero(np.diff(ahead_s) > LEAST_S)
    if len(further) > MOST:  # two clocks in turns, and neither tells anything
        return rows
    for at in further.tolist():
        between = steps_s[told[at] : told[at + 1]]
        if between.max() <= least_s:
            rows.append(int(told[at] + np.argmax(between)))
    return rows
