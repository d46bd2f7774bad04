"""Reads the messages of an `.mcap` of ROS 1 or 2, also of one that is cut or was never closed.

A file is records, each of a kind, a length and its content. Chunks are records that hold records.
"""

import struct
import zlib
from collections.abc import Iterator
from pathlib import Path
from typing import BinaryIO

from bridge.errors import LogError
from identify.ingest.ros.recorded import CutOff, Message, Topic, Wanted, unpacked, unpacked_message

MAGIC = b"\x89MCAP0\r\n"
SCHEMA, CHANNEL, MESSAGE, CHUNK, END_OF_DATA = 0x03, 0x04, 0x05, 0x06, 0x0F
LANGUAGES = {"ros1msg": "msg", "ros2msg": "msg", "ros2idl": "idl", "omgidl": "idl"}
MOST_BYTES = 1 << 31  # of a record; recorders write chunks of some MB
_RECORD = struct.Struct("<BQ")
_MESSAGE = struct.Struct("<HIQQ")  # channel, sequence, time of the log, time of publication; then the bytes
_CHUNK = struct.Struct("<QQQI")  # begin, end, size when unpacked, checksum; then the packing and the bytes

Schemas = dict[int, tuple[str, str, str]]


def read_mcap(path: Path, wanted: Wanted) -> Iterator[Message]:
    """Messages of the wanted topics, chunk by chunk. Raises CutOff, LogError (see `recorded.Reader`)."""
    with path.open("rb") as file:
        if file.read(len(MAGIC)) != MAGIC:
            raise LogError("is no MCAP file; check the file", path)
        schemas: Schemas = {}
        topics: dict[int, Topic | None] = {}
        is_damaged = False
        for kind, content in _outer(file):
            try:
                records = _inner(_chunk(content, path)) if kind == CHUNK else iter([(kind, content)])
                yield from _messages(records, schemas, topics, wanted, path)
            except CutOff:
                is_damaged = True
        if is_damaged:
            raise CutOff


def _messages(
    records: Iterator[tuple[int, bytes]],
    schemas: Schemas,
    topics: dict[int, Topic | None],
    wanted: Wanted,
    path: Path,
) -> Iterator[Message]:
    """The messages in some records; the topics that they announce are added to `topics`, their types to `schemas`."""
    for kind, held in records:
        if kind == MESSAGE:
            if len(held) < _MESSAGE.size:
                raise CutOff
            channel, _, time_ns, _ = _MESSAGE.unpack_from(held)
            topic = topics.get(channel)
            if topic is not None:
                yield topic, time_ns, unpacked_message(held[_MESSAGE.size :], path)
        elif kind == SCHEMA:
            words = _Words(held, 2)
            schemas[int.from_bytes(held[:2], "little")] = words.text(), words.text(), words.text()
        elif kind == CHANNEL:
            number, topic = _topic(held, schemas)
            if number not in topics:
                topics[number] = topic if wanted(topic) else None


def _outer(file: BinaryIO) -> Iterator[tuple[int, bytes]]:
    """Records up to the end of the data; of a chunk that is cut, its beginning. Raises CutOff after the last, where it
    is cut."""
    while True:
        lead = file.read(_RECORD.size)
        if len(lead) < _RECORD.size:
            raise CutOff
        kind, length = _RECORD.unpack(lead)
        if kind == END_OF_DATA:
            return
        if length > MOST_BYTES:
            raise CutOff
        content = file.read(length)
        if len(content) == length or kind == CHUNK:
            yield kind, content
        if len(content) < length:
            raise CutOff


def _inner(data: bytes) -> Iterator[tuple[int, bytes]]:
    """Records of a chunk. Raises CutOff after the last whole one, if the chunk is cut."""
    at = 0
    while at < len(data):
        start = at + _RECORD.size
        if start > len(data):
            raise CutOff
        kind, length = _RECORD.unpack_from(data, at)
        at = start + length
        if at > len(data):
            raise CutOff
        yield kind, data[start:at]


def _chunk(content: bytes, path: Path) -> bytes:
    """The records in a chunk, of a chunk that is cut its beginning. Raises CutOff if its checksum is wrong: packed data
    that are damaged unpack to numbers that nobody measured."""
    if len(content) < _CHUNK.size:
        raise CutOff
    words = _Words(content, _CHUNK.size)
    packing = words.text()
    _, _, size, checksum = _CHUNK.unpack_from(content)
    data = unpacked(content[words.at + 8 :], packing, size, path)
    if checksum and len(data) == size and zlib.crc32(data) != checksum:
        raise CutOff
    return data


def _topic(content: bytes, schemas: Schemas) -> tuple[int, Topic]:
    number, schema = int.from_bytes(content[:2], "little"), int.from_bytes(content[2:4], "little")
    words = _Words(content, 4)
    name, encoding = words.text(), words.text()
    kind, language, definition = schemas.get(schema, ("", "", ""))
    known = LANGUAGES.get(language, "")
    return number, Topic(name, kind, encoding, known, definition if known else "")


class _Words:
    """Reads texts, each behind its length, from `at` on. Raises CutOff."""

    def __init__(self, data: bytes, at: int) -> None:
        self._data, self.at = data, at

    def text(self) -> str:
        start = self.at + 4
        self.at = start + int.from_bytes(self._data[self.at : start], "little")
        if max(start, self.at) > len(self._data):
            raise CutOff
        return self._data[start : self.at].decode("utf-8", "replace")
