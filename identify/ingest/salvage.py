"""Locates, checks and dates a recording's frames: by the compiled walk if intact, otherwise by `bridge.tlog`.

The result is that of `bridge.tlog.TlogReader`, record by record, as arrays.
"""

from collections import Counter
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np

from bridge.tlog import LATEST_US, OUTLIER_US, load_recording, mended, next_record
from identify.ingest.walk import EXTRAS, LONGEST_1, Bytes, Rows, headers, intact

SHORTEST_FRAME: Final = 8
LOST: Final = -1


@dataclass(frozen=True)
class Located:
    """The frames of known ids in a file, in its order: columns (n,) into `data`.

    `stamp_us`: mended Unix time; `start` and `length` of the payload. `counts` as in TlogReader.
    """

    data: Bytes
    stamp_us: Rows
    start: Rows
    length: Rows
    system: Rows
    component: Rows
    message: Rows
    counts: Counter[str]


def locate(path: Path) -> Located:
    """Locate every intact frame of a `.tlog` or `.tlog.gz`. Raises LogError as TlogReader does."""
    data, gzip_whole = load_recording(path)
    counts = Counter[str]() if gzip_whole else Counter(cut=1)
    content = np.frombuffer(data, np.uint8)
    starts, stampless, unknown = _starts(data, content, counts)
    table = np.empty((6, len(starts)), np.int64)
    headers(content, starts, table)
    stamp_us = table[0]
    stamp_us[(stamp_us < 0) | (stamp_us >= LATEST_US)] = LOST
    stamp_us[stampless] = LOST
    table[0] = mended_stamps(stamp_us, counts)
    if unknown:
        table = np.delete(table, unknown, axis=1)
    stamp_us, start, length, system, component, message = table
    return Located(content, stamp_us, start, length, system, component, message, counts)


def _starts(data: bytes, content: Bytes, counts: Counter[str]) -> tuple[Rows, list[int], list[int]]:
    """Start of each frame; rows whose stamp was lost with the bytes before the frame; rows of unknown ids."""
    # Most of this array is never touched, and so takes no memory.
    starts = np.empty(len(data) // SHORTEST_FRAME + 1, np.int64)
    stampless, unknown = [], []
    count, position = intact(content, 0, EXTRAS, LONGEST_1, starts, 0)
    while (record := next_record(data, position, counts)) is not None:
        position, stamp, frame = record
        starts[count] = position - len(frame.raw)
        if stamp is None:
            stampless.append(count)
        if not frame.known:
            unknown.append(count)
        count, position = intact(content, position, EXTRAS, LONGEST_1, starts, count + 1)
    counts["records"] += count
    return starts[:count], stampless, unknown


def mended_stamps(stamp_us: Rows, counts: Counter[str]) -> Rows:
    """Stamps (n,) in us, with LOST stamps and outliers replaced as by `bridge.tlog.mended`."""
    known = stamp_us != LOST
    before = np.concatenate(([LOST], stamp_us[:-1]))
    after = np.append(stamp_us[known], LATEST_US)[np.cumsum(known)]
    low, high = np.minimum(before, after), np.maximum(before, after)
    outside = (stamp_us < low - OUTLIER_US) | (stamp_us > high + OUTLIER_US)
    out = stamp_us.copy()
    reached = 0
    for first in np.flatnonzero(outside | ~known):
        row = int(first)
        changed = row >= reached
        # A changed stamp is a new neighbour for the stamp after it.
        while changed and row < len(out):
            recorded = int(stamp_us[row]) if known[row] else None
            following = int(after[row]) if after[row] < LATEST_US else None
            stamp = mended(recorded, int(out[row - 1]) if row else None, following)
            changed = stamp != recorded
            if changed:
                counts["stamps mended"] += 1
            out[row] = stamp
            row += 1
        reached = max(reached, row)
    return out
