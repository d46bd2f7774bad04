"""The signature of one MAVLink 2 frame, as defined on the MAVLink guide's page on message signing.

Thirteen bytes after the checksum: the link's number, the time in steps of 10 us since 2015 in 6 bytes (little
endian), and the first 6 bytes of SHA-256 over key, header, payload, checksum, link and time.
"""

import hashlib
import hmac
from functools import lru_cache
from typing import Final

from fastcrc.crc16 import mcrf4xx

from bridge.errors import FrameError
from bridge.framing import MAGIC_2, SIGNATURE_BYTES, SIGNED

FLAGS_AT: Final = 2
HEADER_BYTES: Final = 10
DIGEST_BYTES: Final = 6
TIME_BYTES: Final = 6


def is_signed(raw: bytes) -> bool:
    """Whether a complete frame carries a signature, of any key."""
    return raw[0] == MAGIC_2 and bool(raw[FLAGS_AT] & SIGNED)


def signed(raw: bytes, secret: bytes, link: int, time: int) -> bytes:
    """Return a complete frame signed with `secret` (32 bytes); it replaces a signature that the frame carries.

    link: 0 to 255; time: steps of 10 us since 2015, below 2^48. Raises FrameError for MAVLink 1, which has no room
    for a signature.
    """
    if raw[0] != MAGIC_2:
        raise FrameError("a frame of MAVLink 1 can't be signed; let what sends it speak MAVLink 2")
    stamped = _flagged(unsigned(raw)) + bytes((link,)) + time.to_bytes(TIME_BYTES, "little")
    return stamped + _digest(secret, stamped)


def unsigned(raw: bytes) -> bytes:
    """Return a complete frame without its signature; its checksum stays as right or wrong as it was."""
    return _flagged(raw[:-SIGNATURE_BYTES]) if is_signed(raw) else raw


def is_of(raw: bytes, secret: bytes) -> bool:
    """Whether the signature of a signed frame was made with `secret`."""
    return hmac.compare_digest(_digest(secret, raw[:-DIGEST_BYTES]), raw[-DIGEST_BYTES:])


def link_and_time(raw: bytes) -> tuple[int, int]:
    """Return the link number and the time (steps of 10 us since 2015) in a frame's signature."""
    return raw[-SIGNATURE_BYTES], int.from_bytes(raw[-DIGEST_BYTES - TIME_BYTES : -DIGEST_BYTES], "little")


def _digest(secret: bytes, stamped: bytes) -> bytes:
    return hashlib.sha256(secret + stamped).digest()[:DIGEST_BYTES]


def _flagged(raw: bytes) -> bytes:
    """Return a frame without signature, with its signed flag inverted and its checksum changed accordingly."""
    end = HEADER_BYTES + raw[1]
    checksum = int.from_bytes(raw[end : end + 2], "little") ^ _turned(raw[1])
    flags = bytes((raw[FLAGS_AT] ^ SIGNED,))
    return raw[:FLAGS_AT] + flags + raw[FLAGS_AT + 1 : end] + checksum.to_bytes(2, "little")


@lru_cache(maxsize=256)
def _turned(size: int) -> int:
    """XOR change of the checksum when the signed flag is inverted, for a payload of `size` bytes.

    A CRC is linear: the change depends only on the position of the flag, so that a frame with an unknown id can be
    signed too.
    """
    zeros = bytes(HEADER_BYTES + size)
    return int(mcrf4xx(zeros[: FLAGS_AT - 1] + bytes((SIGNED,)) + zeros[FLAGS_AT:]) ^ mcrf4xx(zeros))
