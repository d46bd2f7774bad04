"""Keys that sign frames in what other programs recorded: none of ours has one, and none goes into a file of ours."""

import re
from pathlib import Path
from typing import Final

from bridge.framing import FULL_BYTES, MAGIC_2, SIGNED, frame_at, measure
from bridge.secret import HEADER_BYTES, KEY_AT, SETUP_SIGNING
from bridge.tlog import LATEST_US, STAMP_BYTES, load_bytes

LEFT_OUT: Final = "A key that signs frames was recorded, and is left out."
OLDEST_US: Final = 946_684_800_000_000  # the year 2000
_MAGIC: Final = bytes((MAGIC_2,))
_LIKE_ONE: Final = re.compile(
    b"(?<=" + re.escape(_MAGIC) + b".{6})" + re.escape(SETUP_SIGNING.to_bytes(3, "little")), re.DOTALL
)
_ID_AT: Final = 7


def holds_key(path: Path) -> bool:
    """Whether a recording holds a key that is not all zeros, be the frame with it damaged. Raises LogError."""
    data, _ = load_bytes(path)
    return any(_is_key(data, found.start() - _ID_AT) for found in _LIKE_ONE.finditer(data))


def _is_key(data: bytes, start: int) -> bool:
    """Whether what looks like a SETUP_SIGNING is one: its CRC is right, or it is no longer than one is and a time
    stands before it, so that it is only damaged."""
    end = start + HEADER_BYTES + data[start + 1]
    if not any(data[start + HEADER_BYTES + KEY_AT : end]):
        return False
    length = measure(data, start)
    if length > 0 and start + length <= len(data) and frame_at(data, start, length) is not None:
        return True
    stamp_us = int.from_bytes(data[max(start - STAMP_BYTES, 0) : start], "big")
    is_like_one = data[start + 1] <= FULL_BYTES[SETUP_SIGNING] and not data[start + 2] & ~SIGNED
    return is_like_one and OLDEST_US < stamp_us < LATEST_US
