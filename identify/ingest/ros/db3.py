"""Reads the messages of a ROS 2 bag's `.db3`, a database, also of one that is cut.

SQLite refuses a database that is shorter than it says, but reads its rows up to the first page that is lost once it
says how long it is (SQLite, "Database File Format", section 1.3).
"""

import sqlite3
from collections.abc import Iterator
from contextlib import closing
from pathlib import Path
from urllib.parse import quote

from bridge.errors import LogError
from identify.ingest.ros.recorded import CutOff, Message, Topic, Wanted, unpacked_message

MAGIC = b"SQLite format 3\0"
HEADER_BYTES = 100
PAGE_SIZE, VERSIONS, PAGES = slice(16, 18), slice(18, 20), slice(28, 32)  # in the header, big-endian
WITHOUT_LOG = b"\x01\x01"
"""Versions of a database that has no write-ahead log beside it."""
LARGEST_PAGE_BYTES = 65536
"""Stated as 1, since it fills two bytes."""
_DAMAGED = (sqlite3.Error, UnicodeDecodeError, MemoryError)


def read_db3(path: Path, wanted: Wanted) -> Iterator[Message]:
    """Messages of the wanted topics, as they were written. Raises CutOff, LogError (see `recorded.Reader`)."""
    with path.open("rb") as file:
        header = file.read(HEADER_BYTES)
    if not header.startswith(MAGIC) or len(header) < HEADER_BYTES:
        raise LogError("is no database of a ROS 2 bag; check the file", path)
    log = path.with_name(path.name + "-wal")
    if log.exists() and log.stat().st_size:
        raise LogError(
            f"lacks the messages in {log.name}, which its recorder left when it was killed; take them in with "
            f"`sqlite3 {path.name} 'PRAGMA journal_mode=delete'`, or delete {log.name} to go without",
            path,
        )
    stated = int.from_bytes(header[PAGE_SIZE], "big")
    page_bytes = LARGEST_PAGE_BYTES if stated == 1 else stated
    is_cut = is_damaged = path.stat().st_size < int.from_bytes(header[PAGES], "big") * page_bytes
    try:
        with closing(_cut(path, page_bytes) if is_cut else _whole(path)) as database:
            topics = _topics(database, wanted)
            rows = database.execute("SELECT topic_id, timestamp, data FROM messages ORDER BY id")
            for number, time_ns, data in rows:
                if number in topics and isinstance(data, bytes) and isinstance(time_ns, int):
                    try:
                        message = unpacked_message(data, path)
                    except CutOff:
                        is_damaged = True
                        continue
                    yield topics[number], time_ns, message
    except _DAMAGED:
        raise CutOff from None
    if is_damaged:
        raise CutOff


def _whole(path: Path) -> sqlite3.Connection:
    return sqlite3.connect(f"file:{quote(str(path))}?immutable=1", uri=True)


def _cut(path: Path, page_bytes: int) -> sqlite3.Connection:
    """A copy in memory that says of itself how long it is."""
    data = bytearray(path.read_bytes())
    pages = len(data) // max(page_bytes, 1)
    if not pages:
        raise CutOff
    data[VERSIONS], data[PAGES] = WITHOUT_LOG, pages.to_bytes(4, "big")
    database = sqlite3.connect(":memory:")
    database.deserialize(bytes(data[: pages * page_bytes]))
    return database


def _topics(database: sqlite3.Connection, wanted: Wanted) -> dict[int, Topic]:
    """The wanted topics by number. Bags up to ROS 2 Humble hold no definitions of their types."""
    has_definitions = database.execute("SELECT name FROM sqlite_master WHERE name = 'message_definitions'")
    definitions = {}
    if has_definitions.fetchone():
        rows = database.execute(
            "SELECT topic_type, encoding, encoded_message_definition FROM message_definitions"
        )
        definitions = {
            str(kind): ("idl" if "idl" in str(form) else "msg", str(text))
            for kind, form, text in rows
            if text
        }
    rows = database.execute("SELECT id, name, type, serialization_format FROM topics")
    topics = {
        number: Topic(str(name), str(kind), str(encoding), *definitions.get(str(kind), ("", "")))
        for number, name, kind, encoding in rows
    }
    return {number: topic for number, topic in topics.items() if wanted(topic)}
