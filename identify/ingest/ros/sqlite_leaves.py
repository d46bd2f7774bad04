"""Rows of a table in the pages of a cut SQLite database.

SQLite finds rows from the root of a table down, and refuses them all where a page between is lost. The rows themselves
lie in leaf pages, which name their kind: these are read one by one (SQLite, "Database File Format", sections 1.6 and
2.1).
"""

from collections.abc import Iterator
from typing import Final

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
    """A number of 1 to 9 bytes, and the place after it; that of the end where it is cut."""
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
