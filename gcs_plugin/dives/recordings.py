"""The recordings in a dive's folder, with their start and length.

These are asked for several times a second: of a recording only the first and the last frames are read, and cached.
"""

import contextlib
import gzip
import math
import os
import stat
import zlib
from collections import Counter
from functools import lru_cache
from pathlib import Path
from typing import Final, NamedTuple

from bridge.clock import OLDEST_UNIX_S, date_in_name
from bridge.errors import LogError
from bridge.files import read_small
from bridge.plain import from_json
from bridge.wire.framing import MAGIC_1, MAGIC_2
from bridge.wire.readings import decode
from bridge.wire.tlog import LATEST_US, STAMP, SUFFIXES, next_record
from bridge.wire.whole_recording import files_to_read, number

MINUTE_S: Final = 60.0
GLANCE: Final = ".glance.json"
"""File in which `seatrial dives` caches its reading of a recording, including the start time of the dive."""
MADE_ELSEWHERE: Final = (
    ".bin", ".csv", ".csv.gz", ".txt", ".tsv", ".parquet", ".mat", ".npz", ".ulg", ".jsonl", ".ndjson", ".bag",
    ".bag.active", ".mcap", ".db3", ".mcap.zstd", ".db3.zstd",
)  # fmt: skip
"""Endings of other programs' recordings, as `identify.ingest.open` reads them."""
_KEPT: Final = 4096
_KEPT_ENDS: Final = 256
"""Ends kept: that of a recording under way is another at each look."""


def recordings(folder: Path) -> list[Path]:
    """Recordings of a dive folder, sorted by name, whether they can be opened or not.

    These are `telemetry*.tlog` and `.tlog.gz`, or without any, `telemetry.*` files of other programs. Empty if the
    folder can't be read.
    """
    try:
        names = [name for name in sorted(os.listdir(folder)) if name.startswith("telemetry")]
    except OSError:
        return []
    heard = [name for name in names if name.endswith(SUFFIXES)]
    imported = [n for n in names if n.startswith("telemetry.") and n.lower().endswith(MADE_ELSEWHERE)]
    return [folder / name for name in heard or imported]


def order(folder: Path) -> tuple[float, str]:
    """Sort key of dives, the oldest first: when it began, then name; a dive without a date comes first.

    One without a message yet is as late as the minute in its name lets it be.
    """
    began_unix_s = began(folder)
    if began_unix_s is None:
        return 0.0, folder.name
    by_name = began_unix_s == date_in_name(folder.name)
    return began_unix_s + (MINUTE_S if by_name else 0.0), folder.name


def began(folder: Path) -> float | None:
    """Unix time at which a dive began; None if unknown.

    From the first stamp of its recording, otherwise from GLANCE, otherwise from the folder's name.
    """
    try:
        return _start_s(folder, folder.stat().st_mtime_ns)
    except (OSError, LookupError):
        return date_in_name(folder.name or folder.resolve().name)


@lru_cache(_KEPT)
def _start_s(folder: Path, _changed_ns: int) -> float:
    """Start time of a dive from its recording or GLANCE, cached until a file is added to or removed from the folder.

    Raises LookupError, which is not cached, if neither gives it yet.
    """
    files = recordings(folder)
    first = next(iter(files_to_read(sorted(files, key=number))), None)
    stamp_s = first_stamp_s(first) if first is not None else None
    return _by_glance(folder) if stamp_s is None else stamp_s


def first_stamp_s(file: Path) -> float | None:
    """Stamp of the first frame of a recording, Unix s; None if it has no frame or no valid stamp, or can't be read."""
    try:
        if not file.name.endswith(SUFFIXES) or not stat.S_ISREG(file.stat().st_mode):
            return None
        with gzip.open(file) if file.name.endswith(".gz") else file.open("rb") as opened:
            head = opened.read(STAMP.size + 1)
    except (OSError, EOFError, zlib.error):
        return None
    if len(head) <= STAMP.size or head[-1] not in (MAGIC_1, MAGIC_2):
        return None
    (stamp_us,) = STAMP.unpack_from(head)
    return stamp_us * 1e-6 if OLDEST_UNIX_S * 1e6 < stamp_us < LATEST_US else None


def is_date(unix_s: float) -> bool:
    """Whether a Unix time is plausible: not before 1970, and before the latest valid stamp."""
    return 0.0 <= unix_s < LATEST_US * 1e-6


def _by_glance(folder: Path) -> float:
    """Start time of a dive from GLANCE, Unix s. Raises LookupError if it is missing, damaged or not plausible."""
    try:
        began_unix_s = float(from_json(read_small(folder / GLANCE))["glance"]["began_unix_s"])
    except (OSError, ValueError, TypeError):
        raise LookupError from None
    if not is_date(began_unix_s):
        raise LookupError
    return began_unix_s


END_BYTES: Final = 4096
"""Bytes read at each end of a recording: some fifty frames."""
LONGEST_S: Final = 30 * 86_400.0
"""A longer time between two stamps means that a stamp is damaged."""


def bytes_of(folder: Path) -> int:
    """Size of a dive folder's recordings; 0 for those that can't be looked at."""
    sizes = 0
    for file in recordings(folder):
        with contextlib.suppress(OSError):
            sizes += file.stat().st_size
    return sizes


def length_s(folder: Path) -> float | None:
    """Seconds from the first to the last frame of a dive folder's recordings; None without valid stamps.

    By the vehicle's clocks where they went further than the stamps: a simulated vehicle may be faster than the sea.
    """
    try:
        files = files_to_read(sorted(recordings(folder), key=number))
    except LogError:
        return None
    first_s = next(filter(None, map(first_stamp_s, files)), None)
    ends = list(filter(None, map(_ends, files)))
    if first_s is None or not ends or not 0.0 <= ends[-1].stamp_s - first_s <= LONGEST_S:
        return None
    began_s, end = ends[0].first_s, ends[-1]
    went_s = (clock_s - began_s[clock] for clock, clock_s in end.last_s.items() if clock in began_s)
    return max(end.stamp_s - first_s, *(went for went in went_s if went <= LONGEST_S), 0.0)


Clock = tuple[int, int, str]
"""Of a vehicle: system, component and signal."""


class _Ends(NamedTuple):
    """What each clock says first in a recording, its last stamp, Unix s, and what each clock said last."""

    first_s: dict[Clock, float]
    stamp_s: float
    last_s: dict[Clock, float]


def _ends(file: Path) -> _Ends | None:
    """Both ends of a plain `.tlog`; None if it can't be read, or without an intact frame near its end."""
    try:
        state = file.stat()
    except OSError:
        return None
    is_plain = file.name.endswith(".tlog") and stat.S_ISREG(state.st_mode)
    return _read_ends(file, state.st_size, state.st_mtime_ns) if is_plain else None


@lru_cache(_KEPT_ENDS)
def _read_ends(file: Path, size_bytes: int, _changed_ns: int) -> _Ends | None:
    first_s: dict[Clock, float] = {}
    for _, clock, clock_s in _frames_from(file, 0):
        first_s.setdefault(clock, clock_s)
    dated = [frame for frame in _frames_from(file, max(size_bytes - END_BYTES, 0)) if frame[0] is not None]
    stamps_us = [stamp_us for stamp_us, _, _ in dated if stamp_us is not None]
    last_s = {clock: clock_s for _, clock, clock_s in dated}
    return _Ends(first_s, stamps_us[-1] * 1e-6, last_s) if stamps_us else None


def _frames_from(file: Path, start: int) -> list[tuple[int | None, Clock, float]]:
    """Stamp, Unix us, None if damaged, clock, and what it says, NaN if nothing, of frames from a byte on."""
    try:
        with file.open("rb") as opened:
            opened.seek(start)
            data = opened.read(END_BYTES)
    except OSError:
        return []
    position, frames = 0, []
    while (record := next_record(data, position, Counter())) is not None:
        position, stamp_us, frame = record
        reading = decode(frame)
        signal, clock_s = ("", math.nan) if reading is None else (reading.signal, reading.time_s)
        frames.append((stamp_us, (frame.system, frame.component, signal), clock_s))
    return frames
