"""The ground's recording of a dive and the vehicle's own as one: every frame once, the vehicle's in its own order.

What both have are the same bytes: same system, component, sequence and content, at about the same time. The vehicle's
frames are dated on the ground's clock: where both have a frame, time of arrival minus time on board is at its least
where the link was quickest, so that the least of every ten seconds is the difference of the clocks.
"""

import heapq
import math
from bisect import bisect_left, bisect_right
from collections import defaultdict
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from operator import itemgetter
from pathlib import Path
from typing import Final

import numpy as np
from numpy.typing import NDArray
from pymavlink.dialects.v20 import ardupilotmega as dialect

from bridge.clock_line import ClockLine, fit_clock
from bridge.errors import LogError, NothingRecorded
from bridge.file_size import size_to_read
from bridge.framing import MAGIC_2, Frame
from bridge.new_file import PART, replacing
from bridge.ring.segments import segment_named
from bridge.tlog import GZIP, TlogReader, load_recording, of_those_that_hold_frames, read_tlog, record_of
from gcs_plugin.fetch.doubtful import damaged_before

BLOCK_US: Final = 10_000_000
EARLIEST_US: Final = -1_000_000
LATEST_US: Final = 30_000_000
"""A frame that arrives later after it was sent is another one of the same bytes."""
AGAIN_US: Final = 200_000
MANY: Final = 50
JITTER_S: Final = 2e-3
"""Of the middle of what ten seconds say, at the least."""
STRANGERS: Final = (
    "the vehicle's own recording and the ground's have no frame in common; "
    "check that this is the vehicle's dive"
)
_TRANSFER: Final[int] = dialect.MAVLINK_MSG_ID_FILE_TRANSFER_PROTOCOL

TIMED: Final = frozenset(
    number
    for number, kind in dialect.mavlink_map.items()
    if not {"time_usec", "time_boot_ms", "time_unix_usec"}.isdisjoint(kind.fieldnames)
)
Array = NDArray[np.float64]
Dated = tuple[int, bytes]
"""Unix microseconds and a raw frame."""


@dataclass(frozen=True)
class Whole:
    """What came of it: how many frames the ground had heard of the vehicle, and how many were missing.

    `common`: how many both have. `share`: of each kind of message that states its time and that both hold, what share
    of those heard is also in the vehicle's recording, from the first that is to the last, at the least. `beyond`: how
    many of its frames lie before or after, and are left out. `damaged`: at how many places of it there is no frame;
    `damaged_beyond`: at how many more, which certainly lie before or after.
    `clock`: that of the recording on board against the ground's, of the boot of which most is in common.
    """

    records: list[Dated]
    heard: int
    missing: int
    common: int
    share: float
    beyond: int
    damaged: int
    damaged_beyond: int
    clock: ClockLine


@dataclass(frozen=True)
class _Kept:
    """A frame of the vehicle's own recording: its number in it, its boot, its time on board in Unix microseconds."""

    number: int
    boot: int
    stamp_us: int
    raw: bytes


@dataclass(frozen=True)
class _Offsets:
    """How much the ground's clock is ahead at times on board, both (n,) in us, by blocks of ten seconds: at the least,
    and in the middle. The least dates what was stamped before it was sent; where both sides stamped what arrived, one
    link is late as often as the other. `count`: of frames."""

    least_at_us: Array
    least_us: Array
    usual_at_us: Array
    usual_us: Array
    count: int


class RingFrames:
    """The frames of segments, oldest first, to be iterated over once; one that is empty or cut gives what it holds.

    `damaged`: each place where there is none, by the number of the frame after it, complete after that.
    Raises LogError.
    """

    def __init__(self, files: Sequence[Path]) -> None:
        self.damaged: list[int] = []
        self._files = files

    def __iter__(self) -> Iterator[_Kept]:
        number = 0
        for path in self._files:
            segment = segment_named(path.name.removesuffix(PART))
            try:
                if segment is not None and is_folded(path):
                    raise NothingRecorded(f"{path}: is no recording of a ring")
                reader = TlogReader(path)
            except NothingRecorded:
                self.damaged += [number] * (path.stat().st_size > 0)
                continue
            begins = number
            for stamp_us, frame in reader:
                yield _Kept(number, segment.boot if segment else 0, stamp_us, frame.raw)
                number += 1
            if reader.counts["checksum"]:
                self.damaged += [begins + before for before in damaged_before(load_recording(path)[0])]


def is_folded(path: Path) -> bool:
    """Whether it would be unfolded: no ring writes gzip, and what unfolds on a vehicle's word may have no end."""
    try:
        if size_to_read(path) is None:
            return False
        with path.open("rb") as file:
            return file.read(len(GZIP)) == GZIP
    except OSError:  # who reads it next says why
        return False


def made_whole(
    ground: Sequence[Path], ring: Sequence[Path], source: tuple[int, int], strangers: str = STRANGERS
) -> Whole:
    """Both recordings of one dive as one; `source` is the vehicle's system and component.

    Raises LogError where a file can't be read, or, with the sentence `strangers`, where they have no frame in common.
    """
    aboard = RingFrames(ring)
    kept = _once(aboard)
    heard = [record for records in of_those_that_hold_frames(ground, read_tlog) for record in records]
    places: dict[bytes, list[int]] = defaultdict(list)
    for place, one in enumerate(kept):
        places[one.raw].append(place)
    offset_us = _offsets(kept, heard, places)
    if not offset_us:
        raise LogError(strangers)
    dated = _dated(kept, offset_us)
    both: set[int] = set()
    others: list[tuple[int, Frame]] = []
    copies = 0
    timed: dict[int, list[bool]] = {_number(one.raw): [] for one in kept}
    for stamp_us, frame in heard:
        found = _place(places.get(frame.raw, ()), dated, stamp_us)
        if frame.message_id in timed and frame.message_id in TIMED:
            timed[frame.message_id].append(found is not None)
        if found is not None:
            both.add(found)
            copies += 1
        elif frame.message_id != _TRANSFER:
            others.append((stamp_us, frame))
    if not both:
        raise LogError(strangers)
    first, last = min(both), max(both)
    own = zip(dated[first : last + 1], (one.raw for one in kept[first : last + 1]), strict=True)
    left = ((stamp_us, frame.raw) for stamp_us, frame in others)
    records = list(heapq.merge(own, _rising(left), key=itemgetter(0)))
    told = copies + sum((frame.system, frame.component) == source for _, frame in others)
    span = last + 1 - first
    strange_us = [stamp_us for stamp_us, frame in others if (frame.system, frame.component) == source]
    damaged = _within(aboard.damaged, kept, dated, (first, last), strange_us)
    return Whole(
        records,
        told,
        span - len(both),
        len(both),
        _share(timed.values()),
        len(kept) - span,
        damaged,
        len(aboard.damaged) - damaged,
        _clock(offset_us),
    )


def _once(kept: Iterable[_Kept]) -> list[_Kept]:
    """Without a frame that comes again at once, as where two links of one vehicle were recorded: a sequence number
    comes again only after 255 others."""
    last_us: dict[tuple[int, bytes], int] = {}
    out = []
    for one in kept:
        before_us = last_us.get((one.boot, one.raw))
        last_us[one.boot, one.raw] = one.stamp_us
        if before_us is None or abs(one.stamp_us - before_us) > AGAIN_US:
            out.append(one)
    return out


def _within(
    damaged: Iterable[int],
    kept: Sequence[_Kept],
    dated: Sequence[int],
    both: tuple[int, int],
    strange_us: Sequence[int],
) -> int:
    """How many of the damaged places may be of the dive. `both`: the first and the last frame that both have;
    `strange_us`: when the ground heard frames of the vehicle that its recording lacks, perhaps for the damage.

    A place before a frame that was sent before all that was heard is of the time before; so at the end.
    """
    first, last = both
    begins_us = min((dated[first], *(stamp_us - LATEST_US for stamp_us in strange_us)))
    ends_us = max((dated[last], *(stamp_us - EARLIEST_US for stamp_us in strange_us)))
    early = bisect_right(dated, begins_us, 0, first + 1) - 1
    late = bisect_left(dated, ends_us, last)
    after = kept[early].number if early >= 0 else -1
    up_to = kept[late].number if late < len(kept) else math.inf
    return sum(after < place <= up_to for place in damaged)


def _number(raw: bytes) -> int:
    """The message id of a whole frame."""
    return int.from_bytes(raw[7:10], "little") if raw[0] == MAGIC_2 else raw[5]


def _share(timed: Iterable[Sequence[bool]]) -> float:
    """The least share of what is true from the first to the last of any, over kinds with MANY or more."""
    spans = [np.flatnonzero(found) for found in timed if len(found) >= MANY]
    shares = [len(true) / int(np.ptp(true) + 1) if len(true) > 1 else 0.0 for true in spans]
    return min(shares, default=0.0)


def _clock(offsets: dict[int, _Offsets]) -> ClockLine:
    """The line through the offsets of one boot: what the clock on board is ahead, by the ground's time."""
    found = max(offsets.values(), key=lambda one: one.count)
    here_s, ahead_s = (found.usual_at_us + found.usual_us) * 1e-6, -found.usual_us * 1e-6
    return fit_clock(here_s, ahead_s, np.full(len(here_s), JITTER_S))


def newest_frames(files: Sequence[Path], most_us: int | None) -> tuple[list[Dated], int]:
    """The frames of segments, or the last `most_us` of them, and at how many places there is none.

    Raises LogError where they hold no frame.
    """
    aboard = RingFrames(files)
    records = [(one.stamp_us, one.raw) for one in aboard]
    if not records:
        raise LogError("the vehicle's own recording holds no frame yet; wait a second and fetch again")
    begins_us = records[-1][0] - most_us if most_us is not None else 0
    first = next(place for place, (stamp_us, _) in enumerate(records) if stamp_us >= begins_us)
    damaged = sum(place > first for place in aboard.damaged) if first else len(aboard.damaged)
    return list(_rising(record for record in records if record[0] >= begins_us)), damaged


def write_records(path: Path, records: Iterable[Dated]) -> None:
    """A recording at `path`, whole or not at all, in place of the one before. Raises LogError."""
    with replacing(path, "try again") as file:
        for stamp_us, raw in records:
            file.write(record_of(stamp_us, raw))


def _offsets(
    kept: Sequence[_Kept], heard: Sequence[tuple[int, Frame]], places: dict[bytes, list[int]]
) -> dict[int, _Offsets]:
    """By boot, of frames that state their own time: others may come again, and be lost in between."""
    times: dict[int, dict[int, list[tuple[int, int]]]] = defaultdict(lambda: defaultdict(list))
    met: set[bytes] = set()
    for stamp_us, frame in heard:
        found = places.get(frame.raw, ())
        if len(found) != 1 or frame.raw in met or frame.message_id not in TIMED:
            continue
        met.add(frame.raw)
        one = kept[found[0]]
        times[one.boot][one.stamp_us // BLOCK_US].append((stamp_us - one.stamp_us, one.stamp_us))
    return {boot: _of_boot(list(blocks.values())) for boot, blocks in times.items()}


def _of_boot(blocks: Sequence[list[tuple[int, int]]]) -> _Offsets:
    least = sorted((min(block) for block in blocks), key=itemgetter(1))
    usual = [
        (np.median([ahead_us for ahead_us, _ in block]), np.mean([at_us for _, at_us in block]))
        for block in blocks
    ]
    return _Offsets(
        np.array([at_us for _, at_us in least], np.float64),
        np.array([ahead_us for ahead_us, _ in least], np.float64),
        np.array([at_us for _, at_us in usual], np.float64),
        np.array([ahead_us for ahead_us, _ in usual], np.float64),
        sum(map(len, blocks)),
    )


def _dated(kept: Sequence[_Kept], offsets: dict[int, _Offsets]) -> list[int]:
    """When each was sent, on the ground's clock. A boot that nobody heard begins where the one before it ended."""
    stamps = np.array([one.stamp_us for one in kept], np.float64)
    boots = np.array([one.boot for one in kept])
    dated = np.empty(len(kept))
    for boot, found in offsets.items():
        own = boots == boot
        dated[own] = stamps[own] + np.interp(stamps[own], found.least_at_us, found.least_us)
    known = np.isin(boots, list(offsets))
    for boot in np.unique(boots[~known]):
        own = boots == boot
        begins = dated[known & (boots < boot)].max(initial=-np.inf)
        ends = dated[known & (boots > boot)].min(initial=np.inf)
        begins = begins if np.isfinite(begins) else ends
        dated[own] = np.minimum(begins + stamps[own] - stamps[own][0], ends)
    # A recording has no time before 1970, and a ground whose clock stands there may have heard the last first.
    return [round(one) for one in np.maximum.accumulate(np.maximum(dated, 0.0)).tolist()]


def _place(places: Sequence[int], dated: Sequence[int], stamp_us: int) -> int | None:
    """Which of the vehicle's frames of the same bytes arrived then; None where none can have."""
    latest = bisect_left(places, stamp_us - EARLIEST_US, key=dated.__getitem__) - 1
    if latest < 0 or stamp_us - dated[places[latest]] > LATEST_US:
        return None
    return places[latest]


def _rising(records: Iterable[Dated]) -> Iterator[Dated]:
    """With stamps that never run back."""
    newest_us = 0
    for stamp_us, raw in records:
        newest_us = max(newest_us, stamp_us)
        yield newest_us, raw
