"""A packet of MAVLink FTP, carried in the 251 bytes of FILE_TRANSFER_PROTOCOL.

Source: the MAVLink developer guide, File Transfer Protocol. Little-endian: sequence u16, session u8, opcode u8, size
u8, request opcode u8, burst complete u8, padding u8, offset u32, then up to 239 bytes.
"""

import struct
import zlib
from dataclasses import dataclass, replace
from enum import IntEnum
from typing import Final

PAYLOAD_BYTES: Final = 251
DATA_BYTES: Final = 239
_HEAD: Final = struct.Struct("<HBBBBBBI")


class Op(IntEnum):
    """Opcodes of requests, and of the two answers."""

    NONE = 0
    TERMINATE = 1
    RESET = 2
    LIST = 3
    OPEN_READ = 4
    READ = 5
    CREATE = 6
    WRITE = 7
    REMOVE = 8
    MAKE_FOLDER = 9
    REMOVE_FOLDER = 10
    OPEN_WRITE = 11
    TRUNCATE = 12
    RENAME = 13
    CRC32 = 14
    BURST = 15
    ACK = 128
    NAK = 129


class Fault(IntEnum):
    """Why a request is refused: the first byte of a NAK's data."""

    FAIL = 1
    ERRNO = 2
    SIZE = 3
    SESSION = 4
    NO_SESSIONS = 5
    END = 6
    UNKNOWN = 7
    EXISTS = 8
    PROTECTED = 9
    NOT_FOUND = 10


@dataclass(frozen=True, slots=True)
class Packet:
    """One packet. `size` is the length of `data`; a read request asks for `size` bytes and carries none."""

    sequence: int
    session: int
    op: int
    size: int = 0
    request: int = 0
    complete: bool = False
    offset: int = 0
    data: bytes = b""

    def encode(self) -> bytes:
        """Return the bytes without the zeros that fill up the 251; MAVLink 2 would cut them again."""
        head = (self.sequence, self.session, self.op, self.size, self.request, self.complete, 0, self.offset)
        return _HEAD.pack(*head) + self.data


def decode(payload: bytes) -> Packet:
    """Return the packet in a payload of any length: missing bytes are zero, and data beyond `size` is ignored."""
    whole = payload[:PAYLOAD_BYTES].ljust(PAYLOAD_BYTES, b"\0")
    sequence, session, op, size, request, complete, _, offset = _HEAD.unpack_from(whole)
    data = whole[_HEAD.size : _HEAD.size + size]
    return Packet(sequence, session, op, size, request, bool(complete), offset, data)


def acknowledged(
    asked: Packet, data: bytes = b"", offset: int | None = None, session: int | None = None
) -> Packet:
    """Return the answer that grants a request."""
    return Packet(
        asked.sequence + 1 & 0xFFFF,
        asked.session if session is None else session,
        Op.ACK,
        len(data),
        asked.op,
        offset=asked.offset if offset is None else offset,
        data=data,
    )


def refused(asked: Packet, fault: Fault) -> Packet:
    return replace(acknowledged(asked, bytes((fault,))), op=Op.NAK)


def crc32(data: bytes, crc: int = 0) -> int:
    """Checksum of MAVLink FTP: zlib's, but begun at 0 and not inverted at the end. `crc` is the checksum so far."""
    return zlib.crc32(data, crc ^ 0xFFFFFFFF) ^ 0xFFFFFFFF
