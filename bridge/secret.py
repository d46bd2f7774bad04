"""Keeps the key of MAVLink's signing, which SETUP_SIGNING carries, out of recordings."""

from typing import Final

from fastcrc.crc16 import mcrf4xx
from pymavlink.dialects.v20 import ardupilotmega as dialect

from bridge.framing import CRC_EXTRA, MAGIC_2

SETUP_SIGNING: Final[int] = dialect.MAVLINK_MSG_ID_SETUP_SIGNING
SETUP_ID: Final[bytes] = SETUP_SIGNING.to_bytes(3, "little")
ID_AT: Final = 7
HEADER_BYTES: Final = 10
KEY_AT: Final = 10
"""Offset of the key in the payload, after the initial time (8 bytes) and the target system and component."""


def carries_key(raw: bytes) -> bool:
    """Whether a complete frame is a SETUP_SIGNING, or would be but for one wrong byte of its id.

    MAVLink 1 has no number for this message. With any other damage the bytes do not pass for a frame.
    """
    number = raw[ID_AT:HEADER_BYTES]
    if number == SETUP_ID:
        return raw[0] == MAGIC_2
    if len(number) < len(SETUP_ID) or raw[0] != MAGIC_2 or int.from_bytes(number, "little") in CRC_EXTRA:
        return False
    is_near = sum(byte != right for byte, right in zip(number, SETUP_ID, strict=True)) == 1
    return is_near and is_setup(raw[:ID_AT] + SETUP_ID + raw[HEADER_BYTES:])


def is_setup(raw: bytes) -> bool:
    """Whether a frame with the id of SETUP_SIGNING has a right CRC; False if the frame is cut."""
    end = HEADER_BYTES + raw[1]
    return mcrf4xx(raw[1:end] + CRC_EXTRA[SETUP_SIGNING]).to_bytes(2, "little") == raw[end : end + 2]


def without_key(raw: bytes) -> bytes:
    """Return a complete frame as it may be recorded.

    A SETUP_SIGNING is unsigned and has zeros for its key; any other frame is unchanged.
    """
    if not carries_key(raw):
        return raw
    size = raw[1]
    payload = raw[HEADER_BYTES : HEADER_BYTES + min(size, KEY_AT)].ljust(size, b"\0")
    unsealed = bytes((MAGIC_2, size, 0)) + raw[3:ID_AT] + SETUP_ID + payload
    return unsealed + mcrf4xx(unsealed[1:] + CRC_EXTRA[SETUP_SIGNING]).to_bytes(2, "little")
