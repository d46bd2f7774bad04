"""Compiled inner loops that split a recording's bytes into intact frames, headers and fields.

`intact` agrees byte for byte with `bridge.framing.frame_at`: it stops at the first record that is not a frame of a
known id with the right CRC-16/MCRF4XX, and leaves that record to `bridge.tlog.next_record`.
"""

from typing import Final

import numpy as np
from numba import njit
from numpy.typing import NDArray

from bridge.framing import CRC_EXTRA, FULL_BYTES, MAGIC_1, MAGIC_2, SIGNATURE_BYTES
from bridge.tlog import STAMP_BYTES

Bytes = NDArray[np.uint8]
Rows = NDArray[np.int64]

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
