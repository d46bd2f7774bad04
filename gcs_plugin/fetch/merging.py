"""Merge the ground's recording of a dive with the vehicle's own: every frame once, the vehicle's frames in its order.

A frame that both recordings have is the same bytes (same system, component, sequence and content) at about the same
time. The vehicle's frames are dated on the ground's clock, see `clock_alignment`.
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

from bridge.errors import LogError, NothingRecorded
from bridge.files import PART, replacing, size_to_read
from bridge.wire.clock_line import ClockLine
from bridge.wire.framing import Frame, message_id_at
from bridge.wire.segments import segment_named
from bridge.wire.tlog import GZIP, TlogReader, each_nonempty, load_recording, read_tlog, record_of
from gcs_plugin.fetch.clock_alignment import STEP_US, Anchor, Kept, put_on
from gcs_plugin.fetch.merge_order import Hole, as_sent, holes_in, lost_in
from gcs_plugin.fetch.mirror import damaged_before

EARLIEST_US: Final = -1_000_000
LATEST_US: Final = 30_000_000
"""A frame that arrives longer after it was sent is a different frame with the same bytes."""
AGAIN_US: Final = 200_000
MANY: Final = 50
FEW_ASTRAY, MOST_ASTRAY = 20, 0.05
"""Up to this many common frames, or this share of them, may be different frames with the same bytes after all."""
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


@dataclass(frozen=True)
class MergedRecording:
    """The merged recording of a dive.

    records: Unix time in microseconds and raw frame, in order.
    heard: number of the vehicle's frames that the ground had.
    missing: number that only the vehicle's recording had.
    common: number of frames in both.
    share: of the messages heard between the first and the last common one, the share that the vehicle's recording also
        has. Counted for each type of message that states its time and is in both; the least over these types.
    beyond: number of the vehicle's frames sent before the first or after the last that the ground heard, left out.
    damaged: number of places in the vehicle's recording without a readable frame.
    damaged_beyond: number of further such places that certainly lie before or after the dive.
    clock: the clock on board against the ground's, from the boot with the most common frames.
    guessed: number of the vehicle's frames in boots without a common frame.
    holes: times in which neither recording has a frame.
    lost: number of frames that both lack outside the holes, by the vehicle's sequence numbers; 0 if it sent files
        meanwhile, because those frames are not kept.
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
    guessed: int
    holes: tuple[Hole, ...]
    lost: int


class RingFrames:
    """The frames of segments, oldest first, for a single iteration. A cut file yields the frames it holds.

    `damaged`: for each damaged place, the number of the frame after it; complete when the iteration is over. Raises
    LogError.
    """

    def __init__(self, files: Sequence[Path]) -> None:
        self.damaged: list[int] = []
        self._files = files

    def __iter__(self) -> Iterator[Kept]:
        number = 0
        for path in self._files:
            segment = segment_named(path.name.removesuffix(PART))
            try:
                if segment is not None and _is_gzip(path):
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


def _is_gzip(path: Path) -> bool:
    """Whether the file is gzip. No ring writes gzip, and a vehicle's gzip file may unfold without end."""
    try:
        if size_to_read(path) is None:
            return False
        with path.open("rb") as file:
            return file.read(len(GZIP)) == GZIP
    except OSError:  # the next reader reports the error
        return False


def merge_recordings(
    ground: Sequence[Path], ring: Sequence[Path], source: tuple[int, int], strangers: str = STRANGERS
) -> MergedRecording:
    """Merge both recordings of one dive; `source` is the vehicle's system and component.

    Raises LogError if a file can't be read or a clock was set while it ran; with the sentence `strangers`, if they have
    no frame in common.
    """
    aboard = RingFrames(ring)
    kept = _once(aboard)
    heard = [record for records in each_nonempty(ground, _forward) for record in records]
    places: dict[bytes, list[int]] = defaultdict(list)
    for place, frame_aboard in enumerate(kept):
        places[frame_aboard.raw].append(place)
    anchors = _anchors(kept, heard, places)
    if not anchors:
        raise LogError(strangers)
    clock = put_on(kept, anchors, ring[0])
    dated = clock.dated
    _refuse_astray(kept, anchors, dated, ring)
    both: set[int] = set()
    ground_only: list[tuple[int, Frame]] = []
    from_vehicle: list[tuple[int, int | None]] = []
    copies = 0
    timed: dict[int, list[bool]] = {message_id_at(frame_aboard.raw, 0): [] for frame_aboard in kept}
    for stamp_us, frame in heard:
        place_aboard = _place(places.get(frame.raw, ()), dated, stamp_us)
        if frame.message_id in timed and frame.message_id in TIMED:
            timed[frame.message_id].append(place_aboard is not None)
        if place_aboard is not None:
            both.add(place_aboard)
            copies += 1
        elif frame.message_id != _TRANSFER:
            ground_only.append((stamp_us, frame))
        if frame.system == source[0] and frame.message_id != _TRANSFER:
            from_vehicle.append((stamp_us, place_aboard))
    if not both:
        raise LogError(strangers)
    first, last = _span(both, from_vehicle, dated)
    inside = zip(
        dated[first : last + 1], (frame_aboard.raw for frame_aboard in kept[first : last + 1]), strict=True
    )
    left = sorted(((stamp_us, frame.raw) for stamp_us, frame in ground_only), key=itemgetter(0))
    records = as_sent(heapq.merge(inside, left, key=itemgetter(0)))
    span = last + 1 - first
    strange_us = [stamp_us for stamp_us, frame in ground_only if (frame.system, frame.component) == source]
    has_files = any(
        frame.message_id == _TRANSFER and (frame.system, frame.component) == source for _, frame in heard
    )
    damaged = _within(aboard.damaged, kept, dated, (first, last), strange_us)
    return MergedRecording(
        records,
        copies + len(strange_us),
        span - len(both),
        len(both),
        _share(timed.values()),
        len(kept) - span,
        damaged,
        len(aboard.damaged) - damaged,
        clock.clock,
        clock.guessed,
        holes_in(records, source),
        0 if has_files else lost_in(records, source),
    )


def _forward(path: Path) -> list[tuple[int, Frame]]:
    """Read a recording of the ground, whose clock is the reference. Raises LogError if this clock was set back."""
    records = list(read_tlog(path))
    for (before_us, _), (after_us, _) in pairwise(records):
        if before_us - after_us > STEP_US:
            raise LogError(
                f"{path}: its own clock was set back by {(before_us - after_us) * 1e-6:.1f} s while it was recorded, "
                "so that nothing can be dated by it; put it to a dive whose clock goes on evenly"
            )
    return records


def _span(
    both: Collection[int], heard: Sequence[tuple[int, int | None]], dated: Sequence[int]
) -> tuple[int, int]:
    """First and last place of the dive in the vehicle's recording.

    `heard`: for each frame of the vehicle that the ground heard, the time and the frame's place, None if the vehicle's
    recording lacks it. If the first frame heard is in the vehicle's recording, the dive begins with it; otherwise
    with the first frame sent after that time. The end is found in the same way.
    """
    first, last = min(both, default=len(dated)), max(both, default=-1)
    begins_us, begins = min(heard, key=itemgetter(0), default=(0, first))
    ends_us, ends = max(heard, key=itemgetter(0), default=(0, last))
    if begins is None:
        first = min(first, bisect_left(dated, begins_us))
    if ends is None:
        last = max(last, bisect_right(dated, ends_us) - 1)
    return first, last


def _once(kept: Iterable[Kept]) -> list[Kept]:
    """Drop a frame that is repeated at once, as when two links of one vehicle were recorded.

    A sequence number repeats only after 255 others. When the clock was set back, the frames before no longer count.
    """
    last_us: dict[tuple[int, bytes], int] = {}
    out: list[Kept] = []
    newest_us = 0
    for frame in kept:
        if frame.stamp_us < newest_us - AGAIN_US:
            last_us.clear()
            newest_us = 0
        newest_us = max(newest_us, frame.stamp_us)
        before_us = last_us.get((frame.boot, frame.raw))
        last_us[frame.boot, frame.raw] = frame.stamp_us
        if before_us is None or abs(frame.stamp_us - before_us) > AGAIN_US:
            out.append(frame)
    return out


def _within(
    damaged: Iterable[int],
    kept: Sequence[Kept],
    dated: Sequence[int],
    both: tuple[int, int],
    strange_us: Sequence[int],
) -> int:
    """Count the damaged places that may belong to the dive.

    `both`: the first and the last place of the dive; `strange_us`: when the ground heard frames of the vehicle that
    its recording lacks, perhaps because of the damage. A place before a frame that was sent before everything heard
    belongs to the time before the dive; likewise at the end.
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
    """Least share of True from the first True to the last, over types with MANY or more messages."""
    spans = [np.flatnonzero(seen) for seen in timed if len(seen) >= MANY]
    shares = [len(true) / int(np.ptp(true) + 1) if len(true) > 1 else 0.0 for true in spans]
    return min(shares, default=0.0)


def newest_frames(files: Sequence[Path], most_us: int | None) -> tuple[list[Dated], int]:
    """Return the frames of segments, or the last `most_us` of them, and the number of damaged places among them.

    Raises LogError if they hold no frame.
    """
    aboard = RingFrames(files)
    records = [(frame.stamp_us, frame.raw) for frame in aboard]
    if not records:
        raise LogError("the vehicle's own recording holds no frame yet; wait a second and fetch again")
    begins_us = records[-1][0] - most_us if most_us is not None else 0
    first = next(place for place, (stamp_us, _) in enumerate(records) if stamp_us >= begins_us)
    damaged = sum(place > first for place in aboard.damaged) if first else len(aboard.damaged)
    return list(_rising(record for record in records if record[0] >= begins_us)), damaged


def write_records(path: Path, records: Iterable[Dated]) -> None:
    """Write a recording to `path`, completely or not at all, in place of any previous file. Raises LogError."""
    with replacing(path, "try again") as file:
        for stamp_us, raw in records:
            file.write(record_of(stamp_us, raw))


def _anchors(
    kept: Sequence[Kept], heard: Sequence[tuple[int, Frame]], places: dict[bytes, list[int]]
) -> list[Anchor]:
    """Find anchors: frames that state their own time and are unique aboard. Others may repeat, with repeats lost."""
    met: set[bytes] = set()
    anchors = []
    for stamp_us, frame in heard:
        at = places.get(frame.raw, ())
        if len(at) != 1 or frame.raw in met or frame.message_id not in TIMED:
            continue
        met.add(frame.raw)
        anchors.append(Anchor(at[0], stamp_us - kept[at[0]].stamp_us))
    return sorted(anchors, key=lambda anchor: anchor.place)


def _refuse_astray(
    kept: Sequence[Kept], anchors: Sequence[Anchor], dated: Sequence[int], ring: Sequence[Path]
) -> None:
    """Raise LogError if many common frames get two different times: the merged recording would hold them twice."""
    late_us = [kept[anchor.place].stamp_us + anchor.ahead_us - dated[anchor.place] for anchor in anchors]
    astray = sum(not EARLIEST_US <= anchor <= LATEST_US for anchor in late_us)
    if astray > max(FEW_ASTRAY, MOST_ASTRAY * len(anchors)):
        raise LogError(
            f"{ring[0]}: its clock and the dive's go by no common time: of {len(anchors)} frames that both have, "
            f"{astray} are up to {max(map(abs, late_us)) * 1e-6:.0f} s apart. One of both was set while it was "
            "recorded; nothing is put together"
        )


def _place(places: Sequence[int], dated: Sequence[int], stamp_us: int) -> int | None:
    """Place of the vehicle's frame with these bytes that arrived at `stamp_us`; None if none can have."""
    latest = bisect_left(places, stamp_us - EARLIEST_US, key=dated.__getitem__) - 1
    if latest < 0 or stamp_us - dated[places[latest]] > LATEST_US:
        return None
    return places[latest]


def _rising(records: Iterable[Dated]) -> Iterator[Dated]:
    """Yield the records with stamps that never run back."""
    newest_us = 0
    for stamp_us, raw in records:
        newest_us = max(newest_us, stamp_us)
        yield newest_us, raw
