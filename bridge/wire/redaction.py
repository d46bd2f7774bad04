"""Keeps signing keys (SETUP_SIGNING) and the contents of transferred files out of recordings."""

from typing import Final

from fastcrc.crc16 import mcrf4xx
from pymavlink.dialects.v20 import ardupilotmega as dialect

from bridge.wire.framing import CRC_EXTRA, MAGIC_1, MAGIC_2
from bridge.wire.ftp import Op

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


FILE_TRANSFER: Final[int] = dialect.MAVLINK_MSG_ID_FILE_TRANSFER_PROTOCOL
OP_AT, REQUEST_AT, CONTENTS_AT = 6, 8, 15
"""Offsets in the payload, in which three bytes for the target stand before the packet."""
_ID_2: Final[bytes] = FILE_TRANSFER.to_bytes(3, "little")


def without_contents(raw: bytes) -> bytes:
    """Return a complete frame as it may be recorded.

    If it carries bytes of a file, it has zeros in their place and is unsigned; any other frame is unchanged.
    """
    if raw[7:10] == _ID_2 and raw[0] == MAGIC_2:
        header = bytes((MAGIC_2, raw[1], 0)) + raw[3:10]
    elif raw[5:6] == _ID_2[:1] and raw[0] == MAGIC_1:
        header = raw[:6]
    else:
        return raw
    payload = raw[len(header) : len(header) + raw[1]]
    if not any(payload[CONTENTS_AT:]):
        return raw
    is_answer = payload[OP_AT] == Op.ACK and payload[REQUEST_AT] in (Op.READ, Op.BURST)
    if not is_answer and payload[OP_AT] != Op.WRITE:
        return raw
    unsealed = header + payload[:CONTENTS_AT].ljust(raw[1], b"\0")
    return unsealed + mcrf4xx(unsealed[1:] + CRC_EXTRA[FILE_TRANSFER]).to_bytes(2, "little")
