"""Length of a dive from the first and last stamp of its recording: quick, as nothing in between is read."""

from collections import Counter
from functools import lru_cache
from pathlib import Path
from stat import S_ISREG
from typing import Final

from bridge.errors import LogError
from bridge.ring.whole import standing_for
from bridge.tlog import next_record
from gcs_plugin.dive_order import first_stamp_s, number, recordings

TAIL_BYTES: Final = 4096
"""Bytes read at the end of a recording: some fifty frames."""
LONGEST_S: Final = 30 * 86_400.0
"""A longer time between two stamps means that a stamp is damaged."""
_KEPT: Final = 4096


def length_s(folder: Path) -> float | None:
    """Seconds from the first to the last frame of a dive folder's recordings; None without valid stamps."""
    try:
        files = standing_for(sorted(recordings(folder), key=number))
    except LogError:
        return None
    first_s = next(filter(None, map(first_stamp_s, files)), None)
    last_s = next(filter(None, map(_last_stamp_s, reversed(files))), None)
    if first_s is None or last_s is None or not 0.0 <= last_s - first_s <= LONGEST_S:
        return None
    return last_s - first_s


def _last_stamp_s(file: Path) -> float | None:
    """Stamp of the last intact frame of a plain `.tlog`, Unix s; None if there is none near its end."""
    try:
        state = file.stat()
        if not file.name.endswith(".tlog") or not S_ISREG(state.st_mode):
            return None
        return _at_end_s(file, state.st_size, state.st_mtime_ns)
    except OSError:
        return None


@lru_cache(_KEPT)
def _at_end_s(file: Path, size_bytes: int, _changed_ns: int) -> float | None:
    with file.open("rb") as opened:
        opened.seek(max(size_bytes - TAIL_BYTES, 0))
        data = opened.read(TAIL_BYTES)
    position, last_us = 0, None
    while (record := next_record(data, position, Counter())) is not None:
        position, stamp_us, _ = record
        last_us = last_us if stamp_us is None else stamp_us
    return None if last_us is None else last_us * 1e-6
