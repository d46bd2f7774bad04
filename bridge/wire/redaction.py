"""Keeps signing keys (SETUP_SIGNING) and the contents of transferred files out of recordings.

Both functions replace the secret bytes of a raw frame with zeros, drop its signature and compute its CRC anew.
"""

from typing import Final

from fastcrc.crc16 import mcrf4xx
from pymavlink.dialects.v20 import ardupilotmega as dialect

from bridge.wire.framing import CRC_EXTRA, MAGIC_1, MAGIC_2
from bridge.wire.ftp import Op

SETUP_SIGNING: Final[int] = dialect.MAVLINK_MSG_ID_SETUP_SIGNING
SETUP_ID: Final[bytes] = SETUP_SIGNING.to_bytes(3, "little")
ID_AT: Final = 7
HEADER_BYTES: Final = 10
"""Of MAVLink 2; the message id is its last three bytes, from ID_AT on."""
KEY_AT: Final = 10
"""Offset of the key in the payload, after the initial time (8 bytes) and the target system and component."""


def carries_key(raw: bytes) -> bool:
    """Whether a complete frame is a SETUP_SIGNING, or would be but for one wrong byte of its id.

    MAVLink 1 has no number for this message. With any other damage the bytes do not pass for a frame.
    """
    message_id = raw[ID_AT:HEADER_BYTES]
    if message_id == SETUP_ID:
        return raw[0] == MAGIC_2
    if len(message_id) < len(SETUP_ID) or raw[0] != MAGIC_2:
        return False
    if int.from_bytes(message_id, "little") in CRC_EXTRA:
        return False
    is_near = sum(byte != right for byte, right in zip(message_id, SETUP_ID, strict=True)) == 1
    return is_near and _has_setup_crc(raw[:ID_AT] + SETUP_ID + raw[HEADER_BYTES:])


def _has_setup_crc(raw: bytes) -> bool:
    """Whether a frame with the id of SETUP_SIGNING has a right CRC; False if the frame is cut."""
    end = HEADER_BYTES + raw[1]
    return _crc(raw[:end], SETUP_SIGNING) == raw[end : end + 2]


def without_key(raw: bytes) -> bytes:
    """Return a complete frame as it may be recorded.

    A SETUP_SIGNING is unsigned and has zeros for its key; any other frame is unchanged.
    """
    if not carries_key(raw):
        return raw
    size = raw[1]
    payload = raw[HEADER_BYTES : HEADER_BYTES + min(size, KEY_AT)].ljust(size, b"\0")
    frame = bytes((MAGIC_2, size, 0)) + raw[3:ID_AT] + SETUP_ID + payload
    return frame + _crc(frame, SETUP_SIGNING)


FILE_TRANSFER: Final[int] = dialect.MAVLINK_MSG_ID_FILE_TRANSFER_PROTOCOL
OP_AT, REQUEST_AT, CONTENTS_AT = 6, 8, 15
"""Offsets in the payload: network, target system and component take three bytes, then the FTP packet begins."""
FILE_TRANSFER_ID: Final[bytes] = FILE_TRANSFER.to_bytes(3, "little")


def without_contents(raw: bytes) -> bytes:
    """Return a complete frame as it may be recorded.

    If it carries bytes of a file, it has zeros in their place and is unsigned; any other frame is unchanged.
    """
    if raw[ID_AT:HEADER_BYTES] == FILE_TRANSFER_ID and raw[0] == MAGIC_2:
        header = bytes((MAGIC_2, raw[1], 0)) + raw[3:HEADER_BYTES]
    elif raw[5:6] == FILE_TRANSFER_ID[:1] and raw[0] == MAGIC_1:
        header = raw[:6]
    else:
        return raw
    payload = raw[len(header) : len(header) + raw[1]]
    if not any(payload[CONTENTS_AT:]):
        return raw
    is_answer = payload[OP_AT] == Op.ACK and payload[REQUEST_AT] in (Op.READ, Op.BURST)
    if not is_answer and payload[OP_AT] != Op.WRITE:
        return raw
    frame = header + payload[:CONTENTS_AT].ljust(raw[1], b"\0")
    return frame + _crc(frame, FILE_TRANSFER)


def _crc(frame: bytes, message_id: int) -> bytes:
    """The CRC of a frame that ends with its payload."""
    return mcrf4xx(frame[1:] + CRC_EXTRA[message_id]).to_bytes(2, "little")
