"""Reads the messages of a ROS 1 bag (`.bag`, version 2.0), also of one that is cut or was never closed.

A bag is records, each of a header of `name=value` fields and of data. Chunks are records that hold records.
"""

import struct
from collections.abc import Iterator
from pathlib import Path
from typing import BinaryIO

from bridge.errors import LogError
from identify.ingest.ros.recorded import CutOff, Message, Topic, Wanted, unpacked

MAGIC = b"#ROSBAG V2.0"
MESSAGE, CHUNK, CONNECTION = b"\x02", b"\x05", b"\x07"
LONGEST_HEADER_BYTES = 1 << 24  # a connection's header, which is the longest, is a topic's name
_LENGTH, _TIME = struct.Struct("<I"), struct.Struct("<II")

Fields = dict[bytes, bytes]


def read_rosbag1(path: Path, wanted: Wanted) -> Iterator[Message]:
    """Messages of the wanted topics, chunk by chunk. Raises CutOff, LogError (see `recorded.Reader`)."""
    with path.open("rb") as file:
        if not file.readline(len(MAGIC) + 1).startswith(MAGIC):
            raise LogError("is no bag of ROS 1 in version 2.0; check the file", path)
        topics: dict[bytes, Topic | None] = {}
        is_damaged = False
        for header, data in _outer(file):
            try:
                if header.get(b"op") == CHUNK:
                    packing = header.get(b"compression", b"").decode("ascii", "replace")
                    size = _LENGTH.unpack(header.get(b"size", b"\0\0\0\0"))[0]
                    yield from _messages(_inner(unpacked(data, packing, size, path)), topics, wanted)
                else:
                    yield from _messages(iter([(header, data)]), topics, wanted)
            except CutOff:
                is_damaged = True
        if is_damaged:
            raise CutOff


def _outer(file: BinaryIO) -> Iterator[tuple[Fields, bytes]]:
    """Records of the file itself; of a chunk that is cut, its beginning. Raises CutOff at the cut."""
    while lead := file.read(_LENGTH.size):
        length = _length(lead)
        header = file.read(length)
        lead = file.read(_LENGTH.size)
        if len(header) < length or len(lead) < _LENGTH.size:
            raise CutOff
        length = _LENGTH.unpack(lead)[0]
        fields = _fields(header)
        data = file.read(length)
        if len(data) == length or fields.get(b"op") == CHUNK:
            yield fields, data
        if len(data) < length:
            raise CutOff


def _inner(data: bytes) -> Iterator[tuple[Fields, bytes]]:
    """Records of a chunk. Raises CutOff after the last whole one, if the chunk is cut."""
    at = 0
    while at < len(data):
        start = at + _LENGTH.size
        body = start + _length(data[at:start]) + _LENGTH.size
        if body > len(data):
            raise CutOff
        end = body + _LENGTH.unpack_from(data, body - _LENGTH.size)[0]
        if end > len(data):
            raise CutOff
        yield _fields(data[start : body - _LENGTH.size]), data[body:end]
        at = end


def _length(lead: bytes) -> int:
    if len(lead) < _LENGTH.size or (length := int(_LENGTH.unpack(lead)[0])) > LONGEST_HEADER_BYTES:
        raise CutOff
    return length


def _fields(header: bytes) -> Fields:
    fields, at = {}, 0
    while at + _LENGTH.size <= len(header):
        end = at + _LENGTH.size + _LENGTH.unpack_from(header, at)[0]
        name, equals, value = header[at + _LENGTH.size : end].partition(b"=")
        if not equals or end > len(header):
            raise CutOff
        fields[name] = value
        at = end
    return fields


def _messages(
    records: Iterator[tuple[Fields, bytes]], topics: dict[bytes, Topic | None], wanted: Wanted
) -> Iterator[Message]:
    """The messages in some records; the wanted topics that they announce are added to `topics`, by connection."""
    for header, data in records:
        kind, connection = header.get(b"op"), header.get(b"conn", b"")
        if kind == CONNECTION and connection not in topics:
            topic = _topic(header, data)
            topics[connection] = topic if wanted(topic) else None
        elif kind == MESSAGE and (said := topics.get(connection)) is not None:
            stamp = header.get(b"time", b"")
            if len(stamp) != _TIME.size:
                raise CutOff
            seconds, nanoseconds = _TIME.unpack(stamp)
            yield said, seconds * 1_000_000_000 + nanoseconds, data


def _topic(header: Fields, data: bytes) -> Topic:
    says = {name: value.decode("utf-8", "replace") for name, value in (header | _fields(data)).items()}
    name = says.get(b"topic", "") or header.get(b"topic", b"").decode("utf-8", "replace")
    return Topic(name, says.get(b"type", ""), "ros1", "msg", says.get(b"message_definition", ""))
