"""Reads the messages of a ROS 2 bag's `.db3`, a database, also of one that is cut.

SQLite finds rows from the root of a table down, and refuses them all where a page between is lost. The rows themselves
lie in leaf pages, which name their kind: of a cut database these are read one by one (SQLite, "Database File Format",
sections 1.6 and 2.1).
"""

import sqlite3
from collections.abc import Iterable, Iterator
from contextlib import closing
from pathlib import Path
from typing import Final
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
COLUMNS = 4
"""Of the messages: id, topic_id, timestamp, data. The other tables of numbers and bytes have fewer or more."""
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
            asked: Iterable[tuple[object, ...]]
            if is_cut:
                asked = (row[1:] for row in rows_in(path.read_bytes(), page_bytes, COLUMNS))
            else:
                asked = database.execute("SELECT topic_id, timestamp, data FROM messages ORDER BY id")
            for number, time_ns, data in asked:
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
    """A copy in memory that says of itself how long it is; SQLite refuses a database that is shorter than it says."""
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


LEAF: Final = 0x0D
"""First byte of a leaf page of a table; other pages begin otherwise."""
SMALLEST_PAGE_BYTES: Final = 512
RESERVED_AT: Final = 20
POINTERS_AT: Final = 8
NEXT_BYTES: Final = 4
"""Each overflow page begins with the number of the next, 0 in the last."""
INTEGERS: Final = {1: 1, 2: 2, 3: 3, 4: 4, 5: 6, 6: 8}
"""Bytes of an integer by its serial type; 8 and 9 are 0 and 1 themselves."""
BLOB: Final = 12

Cell = int | bytes | None


def rows_in(data: bytes, page_bytes: int, columns: int) -> list[tuple[Cell, ...]]:
    """The rows of tables of so many columns, sorted by their row numbers, the first cell of each; text is None.

    `data`: the database, whose first page is not looked at. A row of which a part is lost is left out; all are where
    the pages are smaller than SQLite's.
    """
    if page_bytes < SMALLEST_PAGE_BYTES:
        return []
    usable = page_bytes - data[RESERVED_AT]
    rows: dict[int, tuple[Cell, ...]] = {}
    for start in range(page_bytes, len(data) - page_bytes + 1, page_bytes):
        if data[start] == LEAF:
            for number, record in _records(data, start, page_bytes, usable):
                cells = _cells(record)
                if cells is not None and len(cells) == columns:
                    rows[number] = (number, *cells[1:])
    return [rows[number] for number in sorted(rows)]


def _records(data: bytes, start: int, page_bytes: int, usable: int) -> Iterator[tuple[int, bytes]]:
    """Row number and record of each whole row of a leaf page."""
    for k in range(int.from_bytes(data[start + 3 : start + 5], "big")):
        at = start + POINTERS_AT + 2 * k
        place = start + int.from_bytes(data[at : at + 2], "big")
        if not start < place < start + page_bytes:
            return
        size, place = _varint(data, place)
        number, place = _varint(data, place)
        if size > len(data):
            return
        here = _bytes_in_leaf(size, usable)
        record = bytearray(data[place : place + here])
        page = int.from_bytes(data[place + here : place + here + NEXT_BYTES], "big") if here < size else 0
        while page and len(record) < size:
            begin = (page - 1) * page_bytes
            record += data[begin + NEXT_BYTES : begin + usable][: size - len(record)]
            page = int.from_bytes(data[begin : begin + NEXT_BYTES], "big")
        if len(record) == size:
            yield number, bytes(record)


def _bytes_in_leaf(size: int, usable: int) -> int:
    """How many bytes of a record of this size lie in the leaf page itself."""
    most, least = usable - 35, (usable - 12) * 32 // 255 - 23
    if size <= most:
        return size
    kept = least + (size - least) % (usable - 4)
    return kept if kept <= most else least


def _cells(record: bytes) -> tuple[Cell, ...] | None:
    """The cells of a record; None if it is none."""
    end, at = _varint(record, 0)
    if end > len(record):
        return None
    kinds = []
    while at < end:
        kind, at = _varint(record, at)
        kinds.append(kind)
    cells: list[Cell] = []
    for kind in kinds:
        size = INTEGERS.get(kind, (kind - BLOB) // 2 if kind >= BLOB else 8 * (kind == 7))
        part, at = record[at : at + size], at + size
        if len(part) < size:
            return None
        if kind in INTEGERS:
            cells.append(int.from_bytes(part, "big", signed=True))
        elif kind in (8, 9):
            cells.append(kind - 8)
        else:
            cells.append(part if kind >= BLOB and kind % 2 == 0 else None)
    return tuple(cells)


def _varint(data: bytes, at: int) -> tuple[int, int]:
    """A number of 1 to 9 bytes, and the place after it, at most the end of `data`."""
    value = 0
    for k in range(9):
        if at >= len(data):
            break
        byte = data[at]
        at += 1
        if k == 8:
            return value << 8 | byte, at
        value = value << 7 | byte & 0x7F
        if byte < 0x80:
            break
    return value, at
