"""Put a recording on the clock of another by the frames that both hold, in pieces where its own clock steps.

The difference between a frame's two stamps is smallest when the link was quickest, so the smallest difference in
every ten seconds is the offset between the clocks. A clock that was set, or that restarted with its vehicle, jumps
back or ahead between two frames: the pieces before and after the jump are compared separately.
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
"""A recorder whose clock runs on never stamps a frame this much earlier than the frame before."""
LEAP_US: Final = 200_000
"""A longer time without a frame may mean that the clock was set ahead."""
STEP_US: Final = 250_000
"""A smaller step can't be distinguished from a late link."""
EARLY_US: Final = 30_000_000
"""How far an offset may lie below the median of its ten seconds, as links delay frames. Beyond it, the match is a
different frame with the same bytes."""
COMPARED: Final = 20
"""Number of common frames compared on each side of a step, at most; the clock offset is their median."""
JITTER_S: Final = 2e-3
"""Least standard error of the median offset of ten seconds."""
_SYSTEM_TIME: Final[int] = dialect.MAVLINK_MSG_ID_SYSTEM_TIME
Array = NDArray[np.float64]


@dataclass(frozen=True)
class Kept:
    """A frame of a recording: its number in it, the boot in the name of its file, its stamp in Unix microseconds by
    the recording's own clock, and its bytes."""

    number: int
    boot: int
    stamp_us: int
    raw: bytes


@dataclass(frozen=True)
class Anchor:
    """A frame that both recordings have: its index in the one, and how much later the other stamps it."""

    place: int
    ahead_us: int


@dataclass(frozen=True)
class Step:
    """At time `at_us` of the other clock, this clock was set by `by_us`, or restarted."""

    at_us: int
    by_us: int


@dataclass(frozen=True)
class OneClock:
    """When each frame was sent by the other clock, in us, never running back.

    `clock`: line of this clock against the other, from the piece with the most frames in common. `guessed`: number of
    frames in pieces without a common frame; such a piece is placed at the end of the one before.
    """

    dated: list[int]
    clock: ClockLine
    steps: tuple[Step, ...]
    guessed: int


@dataclass(frozen=True)
class _Offsets:
    """How far the other clock is ahead at times of this one, in us, each array (n,) over blocks of ten seconds.

    `least` is the smallest offset in a block, `usual` the median. The least dates frames that were stamped before
    they were sent; if both sides stamped frames on arrival, each link is late as often as the other. `count`: number
    of frames.
    """

    least_at_us: Array
    least_us: Array
    usual_at_us: Array
    usual_us: Array
    count: int

    @property
    def line(self) -> ClockLine:
        """Line of how far this clock is ahead of the other, over the other's time."""
        here_s, ahead_s = (self.usual_at_us + self.usual_us) * 1e-6, -self.usual_us * 1e-6
        return fit_clock(here_s, ahead_s, np.full(len(here_s), JITTER_S))

    def by_other(self, stamp_us: Array) -> Array:
        """Convert times (n,) to the other clock; extrapolate by the drift outside the common frames."""
        nearest_us = np.clip(stamp_us, self.least_at_us[0], self.least_at_us[-1])
        ahead_us = np.interp(nearest_us, self.least_at_us, self.least_us)
        return stamp_us + ahead_us - self.line.drift * (stamp_us - nearest_us)


def put_on(kept: Sequence[Kept], anchors: Sequence[Anchor]) -> OneClock:
    """Date the frames of a recording, in recorded order, by another recording's clock.

    `anchors`, at least one, rise by place.
    """
    stamps = np.array([item.stamp_us for item in kept], np.float64)
    cuts = _cuts(kept, anchors)
    pieces = list(zip([0, *cuts], [*cuts, len(kept)], strict=True))
    by_piece = [_between(anchors, begins, ends) for begins, ends in pieces]
    offsets = [_offsets(kept, piece_anchors) if piece_anchors else None for piece_anchors in by_piece]
    dated = np.full(len(kept), np.nan)
    for (begins, ends), offset in zip(pieces, offsets, strict=True):
        if offset is not None:
            dated[begins:ends] = offset.by_other(stamps[begins:ends])
    for (begins, ends), offset in zip(pieces, offsets, strict=True):
        if offset is None:
            dated[begins:ends] = _guessed(stamps[begins:ends], dated[:begins], dated[ends:])
    known = [offset for offset in offsets if offset is not None]
    guessed = sum(
        ends - begins for (begins, ends), offset in zip(pieces, offsets, strict=True) if offset is None
    )
    # No recording has a time before 1970, and a recorder whose clock stands there may have heard the last frame
    # first.
    rising = np.maximum.accumulate(np.maximum(dated, 0.0))
    return OneClock(
        [round(item) for item in rising.tolist()],
        max(known, key=lambda one: one.count).line,
        tuple(_steps(kept, pieces, by_piece, rising)),
        guessed,
    )


def _guessed(stamps: Array, before: Array, after: Array) -> Array:
    """Date a piece without common frames: it begins at the end of the piece before and ends before the next."""
    begins_us = np.nanmax(before, initial=-np.inf)
    ends_us = np.nanmin(after, initial=np.inf)
    begins_us = begins_us if np.isfinite(begins_us) else ends_us
    return np.minimum(begins_us + np.maximum.accumulate(stamps - stamps[0]).clip(0.0), ends_us)


def _cuts(kept: Sequence[Kept], anchors: Sequence[Anchor]) -> list[int]:
    """Return the indices of the frames at which a new piece begins."""
    places = [frame.place for frame in anchors]
    ticks = _ticks(kept)
    ticked = [place for place, _, _ in ticks]
    cuts: list[int] = []
    for place in range(1, len(kept)):
        frame, previous = kept[place], kept[place - 1]
        passed_us = frame.stamp_us - previous.stamp_us
        if frame.boot != previous.boot:
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
                # Common frames after the step were sent after those before it.
                is_step = abs(by_us) > STEP_US and passed_us + by_us > -STEP_US
            else:
                is_step = passed_us < -STEP_US or _is_set(ticks, bisect_left(ticked, place), passed_us)
            if is_step:
                cuts.append(place)
    return cuts


def _is_set(ticks: Sequence[tuple[int, int, int]], after: int, passed_us: int) -> bool:
    """Whether the vehicle's boot clock shows that another time passed than the recorder's clock says; `after`: index
    of the first tick after the leap."""
    if not 0 < after < len(ticks):
        return False
    (_, before_us, before_boot_us), (_, after_us, after_boot_us) = ticks[after - 1], ticks[after]
    differs_us = (after_us - before_us) - (after_boot_us - before_boot_us)
    # A vehicle that restarted in between says nothing about the time before.
    return after_boot_us >= before_boot_us and abs(differs_us) > max(STEP_US, abs(passed_us) // 100)


def _ticks(kept: Sequence[Kept]) -> list[tuple[int, int, int]]:
    """Index, stamp and time since boot, both in us, of each SYSTEM_TIME of the component that sent most of them."""
    by_source: dict[tuple[int, int], list[tuple[int, int, int]]] = defaultdict(list)
    for place, record in enumerate(kept):
        if message_id_at(record.raw, 0) != _SYSTEM_TIME:
            continue
        frame = frame_at(record.raw, 0, len(record.raw))
        message = decode(frame) if frame is not None else None
        if frame is not None and message is not None:
            boot_us = 1000 * message.time_boot_ms
            by_source[frame.system, frame.component].append((place, record.stamp_us, boot_us))
    return max(by_source.values(), key=len, default=[])


def _between(anchors: Sequence[Anchor], begins: int, ends: int) -> Sequence[Anchor]:
    first = bisect_left(anchors, begins, key=lambda one: one.place)
    return anchors[first : bisect_left(anchors, ends, key=lambda one: one.place)]


def _offsets(kept: Sequence[Kept], anchors: Sequence[Anchor]) -> _Offsets:
    blocks: dict[int, list[tuple[int, int]]] = defaultdict(list)
    for anchor in anchors:
        stamp_us = kept[anchor.place].stamp_us
        blocks[stamp_us // BLOCK_US].append((anchor.ahead_us, stamp_us))
    usual = [
        (np.median([ahead_us for ahead_us, _ in block]), np.mean([at_us for _, at_us in block]))
        for block in blocks.values()
    ]
    least = sorted(
        (
            min(anchor for anchor in block if anchor[0] >= middle_us - EARLY_US)
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
    """Return the steps within a boot, between neighbouring pieces that both have common frames."""
    known = [(begins, earlier) for (begins, _), earlier in zip(pieces, by_piece, strict=True) if earlier]
    return [
        Step(round(dated[begins]), round(_middle_us(earlier[-COMPARED:]) - _middle_us(later[:COMPARED])))
        for (_, earlier), (begins, later) in pairwise(known)
        if kept[earlier[0].place].boot == kept[later[0].place].boot
    ]


def _middle_us(anchors: Sequence[Anchor]) -> float:
    return float(np.median([anchor.ahead_us for anchor in anchors]))
