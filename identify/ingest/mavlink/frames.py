"""MAVLink frames of a recording as arrays, found by a compiled walk and decoded by message id.

A frame is a row of `Frames`; a field of all messages of an id becomes an array when it is asked for. The walk agrees
byte for byte with `framing.frame_at`. It stops at the first record that is not a frame of a known id with the
right checksum, and leaves that record to `bridge.wire.tlog.next_record`.
"""

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache, cached_property
from itertools import accumulate
from pathlib import Path
from typing import Any, Final

import numpy as np
from numba import njit
from numpy.typing import NDArray
from pymavlink.dialects.v20 import ardupilotmega as dialect

from bridge.wire.framing import CRC_EXTRA, FULL_BYTES, MAGIC_1, MAGIC_2, SIGNATURE_BYTES
from bridge.wire.tlog import (
    LATEST_US,
    OUTLIER_US,
    STAMP_BYTES,
    each_nonempty,
    load_recording,
    mended,
    next_record,
)

_WIRE_TYPES = {
    "char": "S1", "uint8_t": "u1", "int8_t": "i1", "uint16_t": "<u2", "int16_t": "<i2", "uint32_t": "<u4",
    "int32_t": "<i4", "uint64_t": "<u8", "int64_t": "<i8", "float": "<f4", "double": "<f8",
}  # fmt: skip


Bytes = NDArray[np.uint8]
Rows = NDArray[np.int64]


@dataclass(frozen=True)
class Frames:
    """The intact frames of known ids in a recording, in file order, one per row.

    `stamp_us` is the record's Unix time, mended; `start` and `length` locate the payload in `data`. `counts` are those
    of TlogReader: records read and lost.
    """

    data: Bytes
    stamp_us: Rows
    start: Rows
    length: Rows
    system: Rows
    component: Rows
    message: Rows
    counts: Counter[str]

    @cached_property
    def arrival_s(self) -> NDArray[np.float64]:
        """`stamp_us` in seconds."""
        return self.stamp_us.astype(np.float64) * 1e-6

    def __len__(self) -> int:
        return len(self.start)

    def rows(self, name: str) -> Rows:
        """Row numbers of all frames of the message called `name`."""
        return np.flatnonzero(self.message == message_id(name))


@dataclass(frozen=True)
class Fields:
    """The fields of the messages called `name` at `rows` of `frames`."""

    frames: Frames
    name: str
    rows: Rows

    def __len__(self) -> int:
        return len(self.rows)

    def __contains__(self, field: str) -> bool:
        return field in _layout(self.name)

    def __getitem__(self, field: str) -> NDArray[Any]:
        """Values (n,), or (n, k) for an array; bytes missing from a short payload are zero."""
        return self.first(field, None)

    def first(self, field: str, count: int | None) -> NDArray[Any]:
        """First `count` values of an array field, (n, count); None means all."""
        kind, offset = _layout(self.name)[field]
        if count is not None:
            kind = np.dtype((kind.base, (min(count, *kind.shape),)))
        out = np.empty((len(self.rows), kind.itemsize), np.uint8)
        frames = self.frames
        copy_field(frames.data, frames.start, frames.length, self.rows, offset, out)
        values = out.view(kind.base)
        return values if kind.shape else values[:, 0]

    def at(self, chosen: NDArray[Any]) -> "Fields":
        """A subset of the messages, by index or mask."""
        return Fields(self.frames, self.name, self.rows[chosen])


def load_frames(paths: Sequence[Path]) -> Frames:
    """All intact frames of a recording in one or more `.tlog` or `.tlog.gz` files, in their order.

    Raises LogError if a file can't be read, or if none holds a frame. `counts` lists files without frames as "files
    empty".
    """
    files = list(each_nonempty(paths, locate))
    counts: Counter[str] = Counter()
    if len(files) < len(paths):
        counts["files empty"] = len(paths) - len(files)
    for file in files:
        counts.update(file.counts)
    shifts = accumulate((len(file.data) for file in files[:-1]), initial=0)

    def joined(name: str) -> Any:
        return np.concatenate([getattr(file, name) for file in files])

    data = files[0].data if len(files) == 1 else joined("data")
    start = np.concatenate([file.start + shift for file, shift in zip(files, shifts, strict=True)])
    length, system, component, message = map(joined, ("length", "system", "component", "message"))
    return Frames(data, joined("stamp_us"), start, length, system, component, message, counts)


def message_id(name: str) -> int:
    return int(_message_class(name).id)


def message_name(identifier: int) -> str:
    """Name of a message id, or its number if the dialect lacks it."""
    kind = dialect.mavlink_map.get(identifier)
    return str(kind.msgname) if kind else f"message {identifier}"


def _message_class(name: str) -> Any:
    return getattr(dialect, f"MAVLink_{name.lower()}_message")


@cache
def _layout(name: str) -> dict[str, tuple[np.dtype[Any], int]]:
    """Type and payload offset of each field."""
    cls = _message_class(name)
    types = dict(zip(cls.fieldnames, cls.fieldtypes, strict=True))
    layout: dict[str, tuple[np.dtype[Any], int]] = {}
    offset = 0
    for field, count in zip(cls.ordered_fieldnames, cls.array_lengths, strict=True):
        wire = _WIRE_TYPES[types[field]]
        if count:
            kind = np.dtype(f"S{count}") if wire == "S1" else np.dtype((wire, (count,)))
        else:
            kind = np.dtype(wire)
        layout[field] = kind, offset
        offset += kind.itemsize
    return layout


HEADER_1: Final = 6
HEADER_2: Final = 10
AT_ONCE: Final = 8
UNKNOWN: Final = -1

EXTRAS: Final = np.full(max(CRC_EXTRA) + 1, UNKNOWN, np.int64)
"""By message id: the byte that ends the input of its checksum (CRC_EXTRA), or UNKNOWN."""
EXTRAS[list(CRC_EXTRA)] = [extra[0] for extra in CRC_EXTRA.values()]
LONGEST_1: Final = np.array([FULL_BYTES.get(number, 255) for number in range(256)], np.int64)
"""By message id: longest payload that MAVLink 1 may state, since MAVLink 1 cuts no zeros."""


def _tables() -> NDArray[np.int32]:
    """Effect of a byte on the CRC if 0 to 7 bytes follow it, (8, 256) (Kounavis and Berry 2005, slicing by 8)."""
    single = np.arange(256, dtype=np.int32)
    for _ in range(8):
        single = (single >> 1) ^ (0x8408 * (single & 1))
    rows = [single]
    for _ in range(1, AT_ONCE):
        rows.append((rows[-1] >> 8) ^ single[rows[-1] & 0xFF])
    return np.array(rows, np.int32)


_TABLES: Final = _tables()


@njit(cache=True, nogil=True)
def intact(
    data: Bytes, position: int, extras: Rows, longest_1: Rows, starts: Rows, count: int
) -> tuple[int, int]:
    """Write the start of each frame to `starts[count:]`, up to the first record that is not intact.

    Returns the number of starts so far and the position of that record.
    """
    end = data.shape[0]
    while position + STAMP_BYTES + HEADER_1 <= end and count < starts.shape[0]:
        start = position + STAMP_BYTES
        payload = np.int64(data[start + 1])
        signature = np.int64(0)
        if data[start] == MAGIC_2:
            if start + HEADER_2 > end or data[start + 2] > 1:
                break
            head, signature = HEADER_2, SIGNATURE_BYTES * np.int64(data[start + 2])
            number = _little(data, start + 7, 3)
        elif data[start] == MAGIC_1:
            head, number = HEADER_1, np.int64(data[start + 5])
            if payload > longest_1[number]:
                break
        else:
            break
        after = start + head + payload
        whole = int(after + 2 + signature)
        if whole > end or number >= extras.shape[0] or extras[number] == UNKNOWN:
            break
        if _checksum(data, start + 1, after, extras[number]) != _little(data, after, 2):
            break
        starts[count] = start
        count += 1
        position = whole
    return count, position


@njit(cache=True, nogil=True)
def _little(data: Bytes, at: int, size: int) -> np.int64:
    number = np.int64(0)
    for k in range(size):
        number |= np.int64(data[at + k]) << (8 * k)
    return number


@njit(cache=True, nogil=True)
def _checksum(data: Bytes, start: int, stop: int, extra: np.int64) -> np.int64:
    """CRC-16/MCRF4XX of `data[start:stop]` followed by the byte `extra`."""
    crc = np.int64(0xFFFF)
    at = start
    while at + AT_ONCE <= stop:
        crc = (
            _TABLES[7, data[at] ^ (crc & 0xFF)]
            ^ _TABLES[6, data[at + 1] ^ (crc >> 8)]
            ^ _TABLES[5, data[at + 2]]
            ^ _TABLES[4, data[at + 3]]
            ^ _TABLES[3, data[at + 4]]
            ^ _TABLES[2, data[at + 5]]
            ^ _TABLES[1, data[at + 6]]
            ^ _TABLES[0, data[at + 7]]
        )
        at += AT_ONCE
    while at < stop:
        crc = (crc >> 8) ^ _TABLES[0, (crc ^ data[at]) & 0xFF]
        at += 1
    return np.int64((crc >> 8) ^ _TABLES[0, (crc ^ extra) & 0xFF])


@njit(cache=True, nogil=True)
def headers(data: Bytes, starts: Rows, out: Rows) -> None:
    """Fill a column of `out` (6, n) for each frame: stamp in us, payload start and length, system, component, id.

    The stamp is 0 for a frame so near the beginning of the data that no stamp fits before it.
    """
    for i in range(starts.shape[0]):
        start = starts[i]
        stamp = np.int64(0)
        if start >= STAMP_BYTES:
            for byte in data[start - STAMP_BYTES : start]:
                stamp = stamp << 8 | np.int64(byte)
        out[0, i] = stamp
        out[2, i] = data[start + 1]
        if data[start] == MAGIC_2:
            out[1, i] = start + HEADER_2
            out[3, i], out[4, i] = data[start + 5], data[start + 6]
            out[5, i] = _little(data, start + 7, 3)
        else:
            out[1, i] = start + HEADER_1
            out[3, i], out[4, i] = data[start + 3], data[start + 4]
            out[5, i] = data[start + 5]


@njit(cache=True, nogil=True)
def copy_field(data: Bytes, start: Rows, length: Rows, rows: Rows, offset: int, out: Bytes) -> None:
    """Copy the payload bytes from `offset` on, at `rows`, to `out` (n, width); zero if a short payload ends before."""
    # Unsigned indices need no check for negative values, which halves the time.
    width, at = np.uint64(out.shape[1]), np.uint64(0)
    flat = out.reshape(-1)
    for row in rows:
        begin = np.uint64(start[row] + offset)
        have = np.uint64(max(0, min(length[row] - offset, out.shape[1])))
        for k in range(have):
            flat[at + k] = data[begin + k]
        for k in range(have, width):
            flat[at + k] = 0
        at += width


SHORTEST_FRAME: Final = 8
LOST: Final = -1


def locate(path: Path) -> Frames:
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
    return Frames(content, stamp_us, start, length, system, component, message, counts)


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
    """Stamps (n,) in us, with LOST stamps and outliers replaced as by `bridge.wire.tlog.mended`."""
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
