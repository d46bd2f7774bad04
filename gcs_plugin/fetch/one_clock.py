"""A recording put on the clock of another, by what both hold: piece by piece, where its own clock steps.

Where both have a frame, its time in the one minus its time in the other is at its least where the link was quickest,
so that the least of every ten seconds is the difference of the clocks. A clock that was set, or that began anew with
its vehicle, runs back or leaps between two frames: what stands before and after is compared by itself.
"""

from bisect import bisect_left
from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from operator import itemgetter
from typing import Final

import numpy as np
from numpy.typing import NDArray
from pymavlink.dialects.v20 import ardupilotmega as dialect

from bridge.clock_line import ClockLine, fit_clock
from bridge.framing import decode, frame_at, message_id_at

BLOCK_US: Final = 10_000_000
BACK_US: Final = 50_000
"""No recorder whose clock goes on dates a frame so much earlier than the one before it."""
LEAP_US: Final = 200_000
"""A longer time without a frame may be a clock that was set forward."""
STEP_US: Final = 250_000
"""A smaller step is not told from a link that is late."""
EARLY_US: Final = 30_000_000
"""Before most of its ten seconds, which a link may delay: that is another frame of the same bytes."""
COMPARED: Final = 20
"""Frames before and after a step, at the most: how much the clocks differ is their median."""
JITTER_S: Final = 2e-3
"""Of the middle of what ten seconds say, at the least."""
_SYSTEM_TIME: Final[int] = dialect.MAVLINK_MSG_ID_SYSTEM_TIME
Array = NDArray[np.float64]


@dataclass(frozen=True)
class Kept:
    """A frame of a recording: its number in it, the boot that its file is named for, its time by the recording's own
    clock in Unix microseconds."""

    number: int
    boot: int
    stamp_us: int
    raw: bytes


@dataclass(frozen=True)
class Anchor:
    """A frame that both have: its place in the one recording, and how much later the other dates it."""

    place: int
    ahead_us: int


@dataclass(frozen=True)
class Step:
    """At `at_us` of the other clock this one was set by `by_us`, or began anew."""

    at_us: int
    by_us: int


@dataclass(frozen=True)
class OneClock:
    """When each frame was sent by the other clock, in us, never running back.

    `clock`: that of the piece of which most is in common, against the other. `guessed`: how many frames are of pieces
    without a frame in common, which begin where the one before ended.
    """

    dated: list[int]
    clock: ClockLine
    steps: tuple[Step, ...]
    guessed: int


@dataclass(frozen=True)
class _Offsets:
    """How much the other clock is ahead at times of this one, both (n,) in us, by blocks of ten seconds: at the least,
    and in the middle. The least dates what was stamped before it was sent; where both sides stamped what arrived, one
    link is late as often as the other. `count`: of frames."""

    least_at_us: Array
    least_us: Array
    usual_at_us: Array
    usual_us: Array
    count: int

    @property
    def line(self) -> ClockLine:
        """What this clock is ahead, by the other's time."""
        here_s, ahead_s = (self.usual_at_us + self.usual_us) * 1e-6, -self.usual_us * 1e-6
        return fit_clock(here_s, ahead_s, np.full(len(here_s), JITTER_S))

    def by_other(self, stamp_us: Array) -> Array:
        """Times (n,) by the other clock; before the first and after the last frame in common by the drift."""
        nearest_us = np.clip(stamp_us, self.least_at_us[0], self.least_at_us[-1])
        ahead_us = np.interp(nearest_us, self.least_at_us, self.least_us)
        return stamp_us + ahead_us - self.line.drift * (stamp_us - nearest_us)


def put_on(kept: Sequence[Kept], anchors: Sequence[Anchor]) -> OneClock:
    """Date a recording's frames, in the order in which they were recorded, by another's clock.

    `anchors`, at least one, rise by place.
    """
    stamps = np.array([one.stamp_us for one in kept], np.float64)
    cuts = _cuts(kept, anchors)
    pieces = list(zip([0, *cuts], [*cuts, len(kept)], strict=True))
    by_piece = [_between(anchors, begins, ends) for begins, ends in pieces]
    offsets = [_offsets(kept, some) if some else None for some in by_piece]
    dated = np.full(len(kept), np.nan)
    for (begins, ends), found in zip(pieces, offsets, strict=True):
        if found is not None:
            dated[begins:ends] = found.by_other(stamps[begins:ends])
    for (begins, ends), found in zip(pieces, offsets, strict=True):
        if found is None:
            dated[begins:ends] = _guessed(stamps[begins:ends], dated[:begins], dated[ends:])
    known = [found for found in offsets if found is not None]
    guessed = sum(
        ends - begins for (begins, ends), found in zip(pieces, offsets, strict=True) if found is None
    )
    # A recording has no time before 1970, and one whose clock stands there may have heard the last first.
    rising = np.maximum.accumulate(np.maximum(dated, 0.0))
    return OneClock(
        [round(one) for one in rising.tolist()],
        max(known, key=lambda one: one.count).line,
        tuple(_steps(kept, pieces, by_piece, rising)),
        guessed,
    )


def _guessed(stamps: Array, before: Array, after: Array) -> Array:
    """A piece of which nobody else has a frame begins where the one before it ended, and ends before the next."""
    begins_us = np.nanmax(before, initial=-np.inf)
    ends_us = np.nanmin(after, initial=np.inf)
    begins_us = begins_us if np.isfinite(begins_us) else ends_us
    return np.minimum(begins_us + np.maximum.accumulate(stamps - stamps[0]).clip(0.0), ends_us)


def _cuts(kept: Sequence[Kept], anchors: Sequence[Anchor]) -> list[int]:
    """Before which frames another piece begins."""
    places = [one.place for one in anchors]
    ticks = _ticks(kept)
    ticked = [place for place, _, _ in ticks]
    cuts: list[int] = []
    for place in range(1, len(kept)):
        one, before = kept[place], kept[place - 1]
        passed_us = one.stamp_us - before.stamp_us
        if one.boot != before.boot:
            cuts.append(place)
        elif not -BACK_US <= passed_us <= LEAP_US:
            middle = bisect_left(places, place)
            begins = bisect_left(places, cuts[-1]) if cuts else 0
            earlier, later = (
                anchors[max(begins, middle - COMPARED) : middle],
                anchors[middle : middle + COMPARED],
            )
            if earlier and later:
                by_us = _middle_us(later) - _middle_us(earlier)
                # What comes after was not heard before.
                is_step = abs(by_us) > STEP_US and passed_us + by_us > -STEP_US
            else:
                is_step = passed_us < -STEP_US or _is_set(ticks, bisect_left(ticked, place), passed_us)
            if is_step:
                cuts.append(place)
    return cuts


def _is_set(ticks: Sequence[tuple[int, int, int]], after: int, passed_us: int) -> bool:
    """Whether a vehicle's own clock says that another time passed than the recorder's does; `after`: which of its
    words is the first after the leap."""
    if not 0 < after < len(ticks):
        return False
    (_, before_us, before_boot_us), (_, after_us, after_boot_us) = ticks[after - 1], ticks[after]
    differs_us = (after_us - before_us) - (after_boot_us - before_boot_us)
    # One that started anew since says nothing of the time before.
    return after_boot_us >= before_boot_us and abs(differs_us) > max(STEP_US, abs(passed_us) // 100)


def _ticks(kept: Sequence[Kept]) -> list[tuple[int, int, int]]:
    """The place, stamp and time since boot, both in us, of each word that one component says of its boot clock."""
    found: dict[tuple[int, int], list[tuple[int, int, int]]] = defaultdict(list)
    for place, one in enumerate(kept):
        if message_id_at(one.raw, 0) != _SYSTEM_TIME:
            continue
        frame = frame_at(one.raw, 0, len(one.raw))
        message = decode(frame) if frame is not None else None
        if frame is not None and message is not None:
            boot_us = 1000 * message.time_boot_ms
            found[frame.system, frame.component].append((place, one.stamp_us, boot_us))
    return max(found.values(), key=len, default=[])


def _between(anchors: Sequence[Anchor], begins: int, ends: int) -> Sequence[Anchor]:
    first = bisect_left(anchors, begins, key=lambda one: one.place)
    return anchors[first : bisect_left(anchors, ends, key=lambda one: one.place)]


def _offsets(kept: Sequence[Kept], anchors: Sequence[Anchor]) -> _Offsets:
    blocks: dict[int, list[tuple[int, int]]] = defaultdict(list)
    for one in anchors:
        stamp_us = kept[one.place].stamp_us
        blocks[stamp_us // BLOCK_US].append((one.ahead_us, stamp_us))
    usual = [
        (np.median([ahead_us for ahead_us, _ in block]), np.mean([at_us for _, at_us in block]))
        for block in blocks.values()
    ]
    least = sorted(
        (
            min(one for one in block if one[0] >= middle_us - EARLY_US)
            for block, (middle_us, _) in zip(blocks.values(), usual, strict=True)
        ),
        key=itemgetter(1),
    )
    return _Offsets(
        np.array([at_us for _, at_us in least], np.float64),
        np.array([ahead_us for ahead_us, _ in least], np.float64),
        np.array([at_us for _, at_us in usual], np.float64),
        np.array([ahead_us for ahead_us, _ in usual], np.float64),
        len(anchors),
    )


def _steps(
    kept: Sequence[Kept],
    pieces: Sequence[tuple[int, int]],
    by_piece: Sequence[Sequence[Anchor]],
    dated: Array,
) -> list[Step]:
    """Those within a boot, between pieces that both have frames in common."""
    known = [(begins, some) for (begins, _), some in zip(pieces, by_piece, strict=True) if some]
    return [
        Step(round(dated[begins]), round(_middle_us(some[-COMPARED:]) - _middle_us(later[:COMPARED])))
        for (_, some), (begins, later) in pairwise(known)
        if kept[some[0].place].boot == kept[later[0].place].boot
    ]


def _middle_us(anchors: Sequence[Anchor]) -> float:
    return float(np.median([one.ahead_us for one in anchors]))
