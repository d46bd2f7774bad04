"""Keeps the contents of transferred files out of recordings: a file may hold data that no recording may hold."""

from typing import Final

from fastcrc.crc16 import mcrf4xx
from pymavlink.dialects.v20 import ardupilotmega as dialect

from bridge.framing import CRC_EXTRA, MAGIC_1, MAGIC_2
from bridge.ftp.packet import Op

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
