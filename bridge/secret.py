"""What no recording may hold: the key of MAVLink's signing, which SETUP_SIGNING carries."""

from typing import Final

from fastcrc.crc16 import mcrf4xx
from pymavlink.dialects.v20 import ardupilotmega as dialect

from bridge.framing import CRC_EXTRA, MAGIC_2

SETUP_SIGNING: Final = dialect.MAVLINK_MSG_ID_SETUP_SIGNING
HEADER_BYTES: Final = 10
KEY_AT: Final = 10
"""Where the key lies in the payload: after an initial time of 8 bytes and whom it is for."""
_ID: Final = SETUP_SIGNING.to_bytes(3, "little")


def carries_key(raw: bytes) -> bool:
    """Whether a whole frame is a SETUP_SIGNING, which MAVLink 1 has no number for."""
    return raw[7:HEADER_BYTES] == _ID and raw[0] == MAGIC_2


def without_key(raw: bytes) -> bytes:
    """A whole frame as it may be kept: a SETUP_SIGNING with zeros for its key, unsigned; any other as it is."""
    if not carries_key(raw):
        return raw
    size = raw[1]
    payload = raw[HEADER_BYTES : HEADER_BYTES + min(size, KEY_AT)].ljust(size, b"\0")
    unsealed = bytes((MAGIC_2, size, 0)) + raw[3:HEADER_BYTES] + payload
    return unsealed + mcrf4xx(unsealed[1:] + CRC_EXTRA[SETUP_SIGNING]).to_bytes(2, "little")
