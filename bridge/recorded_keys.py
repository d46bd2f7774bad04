"""Finds signing keys in recordings of other programs: ours hold none, and no file that we write gets one."""

import re
from collections.abc import Iterator
from pathlib import Path
from typing import Final

from bridge.framing import FULL_BYTES, MAGIC_2, SIGNED, frame_at, measure
from bridge.secret import HEADER_BYTES, ID_AT, KEY_AT, SETUP_ID, SETUP_SIGNING, is_setup
from bridge.tlog import LATEST_US, STAMP_BYTES, load_bytes

LEFT_OUT: Final = "A key that signs frames was recorded, and is left out."
OLDEST_US: Final = 946_684_800_000_000  # the year 2000
_LENGTHS: Final = range(KEY_AT + 1, FULL_BYTES[SETUP_SIGNING] + 1)
_FLAGS: Final = (0, SIGNED)
_ID: Final = re.compile(rb"\x00(?=\x01\x00)")
_WRONG_ID: Final = re.compile(
    rb"\xfd(?=[\x0b-\x2a][\x00\x01].{4}(?:\x00\x01[^\x00]|\x00[^\x01]\x00|[^\x00]\x01\x00))", re.DOTALL
)
"""A SETUP_SIGNING header in which one byte of the id is wrong."""


def holds_key(path: Path) -> bool:
    """Whether a recording holds a key that is not all zeros, even in a damaged frame. Raises LogError."""
    data, _ = load_bytes(path)
    return any(_is_key(data, start) for start in _starts(data))


def _starts(data: bytes) -> Iterator[int]:
    """Yield the offsets at which a SETUP_SIGNING may begin, if at most one byte of its header is wrong."""
    for found in _ID.finditer(data, ID_AT):
        yield found.start() - ID_AT
    for found in _WRONG_ID.finditer(data):
        yield found.start()


def _is_key(data: bytes, start: int) -> bool:
    """Whether the bytes at `start`, which look like a SETUP_SIGNING, hold a key.

    They do if the CRC is right, or is right once a wrong byte of the header is mended. They also do if length and
    flags fit a SETUP_SIGNING and a plausible time precedes it: the frame is then only damaged.
    """
    header = data[start : start + HEADER_BYTES]
    if len(header) < HEADER_BYTES:
        return False
    stamp_us = int.from_bytes(data[max(start - STAMP_BYTES, 0) : start], "big")
    if header[0] == MAGIC_2 and header[ID_AT:] == SETUP_ID:
        length = measure(data, start)
        has_key = _has_key(data, start, header[1])
        if 0 < length <= len(data) - start and frame_at(data, start, length) is not None:
            return has_key
        is_like_one = header[1] in _LENGTHS and header[2] in _FLAGS
        if is_like_one and has_key and OLDEST_US < stamp_us < LATEST_US:
            return True
    return stamp_us < LATEST_US and any(
        is_setup(mended + data[start + HEADER_BYTES : start + HEADER_BYTES + mended[1] + 2])
        and _has_key(data, start, mended[1])
        for mended in _mended(header)
    )


def _has_key(data: bytes, start: int, length: int) -> bool:
    return any(data[start + HEADER_BYTES + KEY_AT : start + HEADER_BYTES + length])


def _mended(header: bytes) -> Iterator[bytes]:
    """Yield the possible SETUP_SIGNING headers if start byte, length, flags or id of this header is damaged."""
    is_led, has_id = header[0] == MAGIC_2, header[ID_AT:] == SETUP_ID
    lengths = _LENGTHS if is_led and has_id and header[2] in _FLAGS else (header[1],)
    flags = _FLAGS if is_led and has_id and header[1] in _LENGTHS else (header[2],)
    if not (is_led or has_id) or not {*lengths} & {*_LENGTHS} or not {*flags} & {*_FLAGS}:
        return
    for length in lengths:
        for flag in flags:
            yield bytes((MAGIC_2, length, flag)) + header[3:ID_AT] + SETUP_ID
