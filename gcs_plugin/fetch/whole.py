"""The ground's recording of a dive and the vehicle's own as one: every frame once, the vehicle's in its own order.

What both have are the same bytes: same system, component, sequence and content, at about the same time. The vehicle's
frames are dated on the ground's clock: where both have a frame, time of arrival minus time on board is at its least
where the link was quickest, so that the least of every ten seconds is the difference of the clocks.
"""

import heapq
import os
from bisect import bisect_left
from collections import defaultdict
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from operator import itemgetter
from pathlib import Path
from typing import Final

import numpy as np
from numpy.typing import NDArray
from pymavlink.dialects.v20 import ardupilotmega as dialect

from bridge.errors import LogError, NothingRecorded
from bridge.framing import Frame
from bridge.ring.segments import segment_named
from bridge.tlog import of_those_that_hold_frames, read_tlog

BLOCK_US: Final = 10_000_000
EARLIEST_US: Final = -1_000_000
LATEST_US: Final = 30_000_000
"""A frame that arrives later after it was sent is another one of the same bytes."""
STRANGERS: Final = (
    "the vehicle's own recording and the ground's have no frame in common; "
    "check that this is the vehicle's dive"
)
_TRANSFER: Final[int] = dialect.MAVLINK_MSG_ID_FILE_TRANSFER_PROTOCOL

Offsets = dict[int, tuple[NDArray[np.float64], NDArray[np.float64]]]
Dated = tuple[int, bytes]
"""Unix microseconds and a raw frame."""


@dataclass(frozen=True)
class Whole:
    """What came of it: how many frames the ground had heard of the vehicle, and how many were missing."""

    records: list[Dated]
    heard: int
    missing: int


@dataclass(frozen=True)
class _Kept:
    """A frame of the vehicle's own recording: its boot, and its time on board in Unix microseconds."""

    boot: int
    stamp_us: int
    raw: bytes


def ring_frames(files: Sequence[Path]) -> Iterator[_Kept]:
    """The frames of segments, oldest first; one that is empty or cut gives what it holds. Raises LogError."""
    for path in files:
        segment = segment_named(path.name.removesuffix(".part"))
        try:
            records = read_tlog(path)
        except NothingRecorded:
            continue
        for stamp_us, frame in records:
            yield _Kept(segment.boot if segment else 0, stamp_us, frame.raw)


def made_whole(ground: Sequence[Path], ring: Sequence[Path], source: tuple[int, int]) -> Whole:
    """Both recordings of one dive as one; `source` is the vehicle's system and component.

    Raises LogError where a file can't be read, or they have no frame in common.
    """
    kept = list(ring_frames(ring))
    heard = [record for records in of_those_that_hold_frames(ground, read_tlog) for record in records]
    places: dict[bytes, list[int]] = defaultdict(list)
    for place, one in enumerate(kept):
        places[one.raw].append(place)
    offset_us = _offsets(kept, heard, places)
    dated = _dated(kept, offset_us)
    both: set[int] = set()
    others: list[tuple[int, Frame]] = []
    copies = 0
    for stamp_us, frame in heard:
        found = _place(places.get(frame.raw, ()), dated, stamp_us)
        if found is not None:
            both.add(found)
            copies += 1
        elif frame.message_id != _TRANSFER:
            others.append((stamp_us, frame))
    if not both:
        raise LogError(STRANGERS)
    first, last = min(both), max(both)
    own = zip(dated[first : last + 1], (one.raw for one in kept[first : last + 1]), strict=True)
    left = ((stamp_us, frame.raw) for stamp_us, frame in others)
    records = list(heapq.merge(own, _rising(left), key=itemgetter(0)))
    told = copies + sum((frame.system, frame.component) == source for _, frame in others)
    return Whole(records, told, last + 1 - first - len(both))


def newest_frames(files: Sequence[Path], most_us: int | None) -> list[Dated]:
    """The frames of segments, or the last `most_us` of them. Raises LogError where they hold none."""
    records = [(one.stamp_us, one.raw) for one in ring_frames(files)]
    if not records:
        raise LogError("the vehicle's own recording holds no frame yet; wait a second and fetch again")
    begins_us = records[-1][0] - most_us if most_us is not None else 0
    return list(_rising(record for record in records if record[0] >= begins_us))


def write_records(path: Path, records: Iterable[Dated]) -> None:
    """A recording at `path`, whole or not at all, in place of the one before. Raises LogError."""
    partial = path.with_name(path.name + ".part")
    try:
        with partial.open("wb") as file:
            for stamp_us, raw in records:
                file.write(stamp_us.to_bytes(8, "big") + raw)
            file.flush()
            os.fsync(file.fileno())
        partial.replace(path)
    except OSError as error:
        raise LogError(
            f"{path}: can't be written ({error.strerror}); free disk space and fetch again"
        ) from None


def _offsets(
    kept: Sequence[_Kept], heard: Sequence[tuple[int, Frame]], places: dict[bytes, list[int]]
) -> Offsets:
    """By boot, times on board and how much the ground's clock is ahead of them, in us; of frames that are unique."""
    times: dict[int, dict[int, tuple[int, int]]] = defaultdict(dict)
    met: set[bytes] = set()
    for stamp_us, frame in heard:
        found = places.get(frame.raw, ())
        if len(found) != 1 or frame.raw in met:
            continue
        met.add(frame.raw)
        one = kept[found[0]]
        block, sample = one.stamp_us // BLOCK_US, (stamp_us - one.stamp_us, one.stamp_us)
        blocks = times[one.boot]
        blocks[block] = min(blocks.get(block, sample), sample)
    if not times:
        raise LogError(
            "the vehicle's own recording and the ground's have no frame in common; fetch the right dive"
        )
    return {
        boot: (
            np.array([time_us for _, time_us in sorted(blocks.values(), key=itemgetter(1))], np.float64),
            np.array([ahead_us for ahead_us, _ in sorted(blocks.values(), key=itemgetter(1))], np.float64),
        )
        for boot, blocks in times.items()
    }


def _dated(kept: Sequence[_Kept], offsets: Offsets) -> list[int]:
    """When each was sent, on the ground's clock. A boot that nobody heard begins where the one before it ended."""
    stamps = np.array([one.stamp_us for one in kept], np.float64)
    boots = np.array([one.boot for one in kept])
    dated = np.empty(len(kept))
    for boot, (known_us, ahead_us) in offsets.items():
        own = boots == boot
        dated[own] = stamps[own] + np.interp(stamps[own], known_us, ahead_us)
    known = np.isin(boots, list(offsets))
    for boot in np.unique(boots[~known]):
        own = boots == boot
        begins = dated[known & (boots < boot)].max(initial=-np.inf)
        ends = dated[known & (boots > boot)].min(initial=np.inf)
        begins = begins if np.isfinite(begins) else ends
        dated[own] = np.minimum(begins + stamps[own] - stamps[own][0], ends)
    return [round(one) for one in np.maximum.accumulate(dated).tolist()]


def _place(places: Sequence[int], dated: Sequence[int], stamp_us: int) -> int | None:
    """Which of the vehicle's frames of the same bytes arrived then; None where none can have."""
    times = [dated[place] for place in places]
    latest = bisect_left(times, stamp_us - EARLIEST_US) - 1
    if latest < 0 or stamp_us - times[latest] > LATEST_US:
        return None
    return places[latest]


def _rising(records: Iterable[Dated]) -> Iterator[Dated]:
    """With stamps that never run back."""
    newest_us = 0
    for stamp_us, raw in records:
        newest_us = max(newest_us, stamp_us)
        yield newest_us, raw
