"""The ground's recording of a dive and the vehicle's own as one: every frame once, the vehicle's in its own order.

What both have are the same bytes: same system, component, sequence and content, at about the same time. The vehicle's
frames are dated on the ground's clock: where both have a frame, time of arrival minus time on board is at its least
where the link was quickest, so that the least of every ten seconds is the difference of the clocks.
"""

import heapq
import math
from bisect import bisect_left, bisect_right
from collections import defaultdict
from collections.abc import Collection, Iterable, Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise
from operator import itemgetter
from pathlib import Path
from typing import Final

import numpy as np
from pymavlink.dialects.v20 import ardupilotmega as dialect

from bridge.clock_line import ClockLine
from bridge.errors import LogError, NothingRecorded
from bridge.file_size import size_to_read
from bridge.framing import Frame, message_id_at
from bridge.new_file import PART, replacing
from bridge.ring.segments import segment_named
from bridge.tlog import GZIP, TlogReader, load_recording, of_those_that_hold_frames, read_tlog, record_of
from gcs_plugin.fetch.as_sent import as_sent
from gcs_plugin.fetch.doubtful import damaged_before
from gcs_plugin.fetch.holes import Hole, holes_in, lost_in
from gcs_plugin.fetch.one_clock import STEP_US, Anchor, Kept, Step, put_on
from gcs_plugin.fetch.same_boot import by_boot_time

EARLIEST_US: Final = -1_000_000
LATEST_US: Final = 30_000_000
"""A frame that arrives later after it was sent is another one of the same bytes."""
AGAIN_US: Final = 200_000
MANY: Final = 50
FEW_ASTRAY, MOST_ASTRAY = 20, 0.05
"""So many, or so many of all that both have, may be other frames of the same bytes after all."""
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
Dated = tuple[int, bytes]
"""Unix microseconds and a raw frame."""


class Strangers(LogError):
    """Two recordings have hardly a frame in common."""


class Apart(Strangers):
    """Two recordings of one boot of a vehicle, of which one ends before the other begins: `after_s` seconds after the
    dive's, below 0 before it. `ahead_s`: how much its clock is ahead of the dive's."""

    def __init__(self, words: str, after_s: float, ahead_s: float) -> None:
        super().__init__(words)
        self.after_s, self.ahead_s = after_s, ahead_s


@dataclass(frozen=True)
class Whole:
    """What came of it: how many frames the ground had heard of the vehicle, and how many were missing.

    `common`: how many both have. `share`: of each kind of message that states its time and that both hold, what share
    of those heard is also in the vehicle's recording, from the first that is to the last, at the least. `beyond`: how
    many of its frames were sent before the first or after the last that the ground heard, and are left out. `damaged`:
    at how many places of it there is no frame; `damaged_beyond`: at how many more, which certainly lie before or after.
    `clock`: that of the recording on board against the ground's, of the piece of which most is in common; `steps`: when
    it was set meanwhile; `guessed`: how many of its frames are dated by no frame in common.
    `holes`: the times of which neither has anything; `lost`: how many frames beside those neither has, by the vehicle's
    sequence numbers; 0 where it sent files meanwhile, whose frames are not kept.
    `by_boot`: whether both have no frame in common, and were put together by the vehicle's time since boot.
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
    steps: tuple[Step, ...]
    guessed: int
    holes: tuple[Hole, ...]
    lost: int
    by_boot: bool


class RingFrames:
    """The frames of segments, oldest first, to be iterated over once; one that is empty or cut gives what it holds.

    `damaged`: each place where there is none, by the number of the frame after it, complete after that.
    Raises LogError.
    """

    def __init__(self, files: Sequence[Path]) -> None:
        self.damaged: list[int] = []
        self._files = files

    def __iter__(self) -> Iterator[Kept]:
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
                yield Kept(number, segment.boot if segment else 0, stamp_us, frame.raw)
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

    Raises LogError where a file can't be read or no clock line puts both together; Strangers, with the sentence
    `strangers`, where they have no frame in common.
    """
    aboard = RingFrames(ring)
    kept = _once(aboard)
    heard = [record for records in of_those_that_hold_frames(ground, _forward) for record in records]
    places: dict[bytes, list[int]] = defaultdict(list)
    for place, one in enumerate(kept):
        places[one.raw].append(place)
    anchors = _anchors(kept, heard, places)
    booted = [] if anchors else by_boot_time(kept, heard, source)
    if not anchors and not booted:
        raise Strangers(strangers)
    clock = put_on(kept, anchors or booted)
    dated = clock.dated
    _refuse_astray(kept, anchors, dated, ring)
    both: set[int] = set()
    others: list[tuple[int, Frame]] = []
    own: list[tuple[int, int | None]] = []
    copies = 0
    timed: dict[int, list[bool]] = {message_id_at(one.raw, 0): [] for one in kept}
    for stamp_us, frame in heard:
        found = _place(places.get(frame.raw, ()), dated, stamp_us)
        if frame.message_id in timed and frame.message_id in TIMED:
            timed[frame.message_id].append(found is not None)
        if found is not None:
            both.add(found)
            copies += 1
        elif frame.message_id != _TRANSFER:
            others.append((stamp_us, frame))
        if frame.system == source[0] and frame.message_id != _TRANSFER:
            own.append((stamp_us, found))
    if not both and not booted:
        raise Strangers(strangers)
    first, last = _span(both, own, dated)
    if first > last:
        begins_us, ends_us = min(own, key=itemgetter(0))[0], max(own, key=itemgetter(0))[0]
        after_us = dated[0] - ends_us if dated[0] > ends_us else dated[-1] - begins_us
        raise Apart(strangers, after_us * 1e-6, float(clock.clock.offset_s))
    inside = zip(dated[first : last + 1], (one.raw for one in kept[first : last + 1]), strict=True)
    left = sorted(((stamp_us, frame.raw) for stamp_us, frame in others), key=itemgetter(0))
    records = as_sent(heapq.merge(inside, left, key=itemgetter(0)))
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
        clock.clock,
        clock.steps,
        clock.guessed,
        holes_in(records, source),
        0 if _has_files(heard, source) else lost_in(records, source),
        bool(booted),
    )


def _has_files(heard: Iterable[tuple[int, Frame]], source: tuple[int, int]) -> bool:
    return any(
        frame.message_id == _TRANSFER and (frame.system, frame.component) == source for _, frame in heard
    )


def _forward(path: Path) -> list[tuple[int, Frame]]:
    """A recording of the dive's own, whose clock all the rest is put on. Raises LogError where that was set back."""
    records = list(read_tlog(path))
    for (before_us, _), (after_us, _) in pairwise(records):
        if before_us - after_us > STEP_US:
            raise LogError(
                f"{path}: its own clock was set back by {(before_us - after_us) * 1e-6:.1f} s while it was recorded, "
                "so that nothing can be dated by it; put it to a dive whose clock goes on evenly"
            )
    return records


def _span(
    both: Collection[int], own: Sequence[tuple[int, int | None]], dated: Sequence[int]
) -> tuple[int, int]:
    """The first and the last place of the dive. `own`: when the ground heard each frame of the vehicle, and which place
    it has.

    Where the first that was heard is in the vehicle's recording, the dive begins with it; else with what was sent after
    it was heard. So at the end.
    """
    first, last = min(both, default=len(dated)), max(both, default=-1)
    begins_us, begins = min(own, key=itemgetter(0), default=(0, first))
    ends_us, ends = max(own, key=itemgetter(0), default=(0, last))
    if begins is None:
        first = min(first, bisect_left(dated, begins_us))
    if ends is None:
        last = max(last, bisect_right(dated, ends_us) - 1)
    return first, last


def _once(kept: Iterable[Kept]) -> list[Kept]:
    """Without a frame that comes again at once, as where two links of one vehicle were recorded: a sequence number
    comes again only after 255 others. A clock that was set back shows no frame again by its time."""
    last_us: dict[tuple[int, bytes], int] = {}
    out: list[Kept] = []
    newest_us = 0
    for one in kept:
        if one.stamp_us < newest_us - AGAIN_US:
            last_us.clear()
            newest_us = 0
        newest_us = max(newest_us, one.stamp_us)
        before_us = last_us.get((one.boot, one.raw))
        last_us[one.boot, one.raw] = one.stamp_us
        if before_us is None or abs(one.stamp_us - before_us) > AGAIN_US:
            out.append(one)
    return out


def _within(
    damaged: Iterable[int],
    kept: Sequence[Kept],
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


def _share(timed: Iterable[Sequence[bool]]) -> float:
    """The least share of what is true from the first to the last of any, over kinds with MANY or more."""
    spans = [np.flatnonzero(found) for found in timed if len(found) >= MANY]
    shares = [len(true) / int(np.ptp(true) + 1) if len(true) > 1 else 0.0 for true in spans]
    return min(shares, default=0.0)


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


def _anchors(
    kept: Sequence[Kept], heard: Sequence[tuple[int, Frame]], places: dict[bytes, list[int]]
) -> list[Anchor]:
    """Of frames that state their own time: others may come again, and be lost in between."""
    met: set[bytes] = set()
    anchors = []
    for stamp_us, frame in heard:
        found = places.get(frame.raw, ())
        if len(found) != 1 or frame.raw in met or frame.message_id not in TIMED:
            continue
        met.add(frame.raw)
        anchors.append(Anchor(found[0], stamp_us - kept[found[0]].stamp_us))
    return sorted(anchors, key=lambda one: one.place)


def _refuse_astray(
    kept: Sequence[Kept], anchors: Sequence[Anchor], dated: Sequence[int], ring: Sequence[Path]
) -> None:
    """Raise LogError where many of the frames that both have come to two times: they would be there twice."""
    late_us = [kept[one.place].stamp_us + one.ahead_us - dated[one.place] for one in anchors]
    astray = sum(not EARLIEST_US <= one <= LATEST_US for one in late_us)
    if astray > max(FEW_ASTRAY, MOST_ASTRAY * len(anchors)):
        raise LogError(
            f"{ring[0]}: its clock and the dive's go by no common time: of {len(anchors)} frames that both have, "
            f"{astray} are up to {max(map(abs, late_us)) * 1e-6:.0f} s apart. One of both was set while it was "
            "recorded; nothing is put together"
        )


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
