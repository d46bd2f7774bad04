"""Messages of a topic as columns of numbers.

Messages of a type whose texts and lists are of the same lengths have each field at the same place. So the places are
looked up once for all such messages, and each field of all of them is read at once.
"""

from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from bridge.arrays import Array, Mask
from identify.ingest.files.streams import LONGEST_LIST
from identify.ingest.ros.definitions import Fields, Types

DEEPEST = 20
TIMES = ("builtin_interfaces/msg/Time", "builtin_interfaces/msg/Duration")
NUMBERS = {
    "bool": "u1", "byte": "u1", "char": "u1", "octet": "u1", "int8": "i1", "uint8": "u1", "int16": "i2",
    "uint16": "u2", "int32": "i4", "uint32": "u4", "int64": "i8", "uint64": "u8", "float32": "f4", "float64": "f8",
}  # fmt: skip
TIME_TYPE = "time"
_BASE, _NAME, _ARRAY = 1, 2, 3  # kinds of a field, in rosbags
CDR_LEAD_BYTES = 4
MOST_LAYOUTS = 64
"""Of messages of equal size; with more, messages are hardly ever alike, and each is read by itself."""


class Undefined(Exception):
    """A type that is defined nowhere, or holds what can't be read; its text is the type's name."""


class _Misfit(Exception):
    """A message that ends before its definition does."""


class _Unending(Exception):
    """A list of too many parts to walk through; what follows it is left out."""


@dataclass
class _Layout:
    """The places of a message's fields: name, first byte, type of the number.

    `lengths`: first byte and content of what decides the places.
    """

    order: str
    places: list[tuple[str, int, str]] = field(default_factory=list)
    lengths: list[tuple[int, bytes]] = field(default_factory=list)


def columns_of(
    messages: Sequence[bytes], kind: str, types: Types, cdr: bool
) -> tuple[dict[str, Array], Mask]:
    """Each numeric field of messages of type `kind`, (n,) by name, NaN in messages without it; and whether (n,) a
    message fits its definition.

    Names are those of the fields joined by `.`, elements of a list are numbered from 0. Times are in s. Raises
    Undefined.
    """
    columns: dict[str, Array] = {}
    fits = np.zeros(len(messages), np.bool_)
    by_size: dict[int, list[int]] = defaultdict(list)
    for number, message in enumerate(messages):
        by_size[len(message)].append(number)
    by_size.pop(0, None)
    for size, numbers in by_size.items():
        rows = np.array(numbers, np.intp)
        block = np.frombuffer(b"".join([messages[number] for number in numbers]), np.uint8).reshape(-1, size)
        left, tried = np.arange(len(rows)), 0
        while len(left):
            tried += 1
            try:
                layout = _layout(messages[rows[left[0]]], kind, types, cdr)
            except _Misfit:
                left = left[1:]
                continue
            alike = left == left[0]
            if tried < MOST_LAYOUTS:
                alike[:] = True
                for start, content in layout.lengths:
                    held = np.frombuffer(content, np.uint8)
                    alike &= (block[left, start : start + len(content)] == held).all(axis=1)
            fits[rows[left[alike]]] = True
            _read(columns, layout, block[left[alike]], rows[left[alike]], len(messages))
            left = left[~alike]
    return columns, fits


def _read(
    columns: dict[str, Array], layout: _Layout, block: NDArray[np.uint8], rows: NDArray[np.intp], count: int
) -> None:
    for name, start, number in layout.places:
        if name not in columns:
            columns[name] = np.full(count, np.nan)
        if number == TIME_TYPE:
            seconds, nanoseconds = (
                _numbers(block, start + at, f"{layout.order}{part}") for at, part in ((0, "i4"), (4, "u4"))
            )
            columns[name][rows] = seconds + 1e-9 * nanoseconds
        else:
            columns[name][rows] = _numbers(block, start, f"{layout.order}{number}")


def _numbers(block: NDArray[np.uint8], start: int, number: str) -> Array:
    kind = np.dtype(number)
    cells = np.ascontiguousarray(block[:, start : start + kind.itemsize])
    return cells.view(kind)[:, 0].astype(np.float64)


def _layout(message: bytes, kind: str, types: Types, cdr: bool) -> _Layout:
    """Raises Undefined, _Misfit."""
    if not cdr:
        walk = _Walk(message, 0, "<", types, aligns=False)
    elif len(message) < CDR_LEAD_BYTES or message[0] != 0 or message[1] > 1:
        raise _Misfit
    else:
        walk = _Walk(message, CDR_LEAD_BYTES, "<" if message[1] else ">", types, aligns=True)
        walk.layout.lengths.append((0, message[:2]))
    try:
        walk.fields(_defined(types, kind), "", 0)
    except _Unending:
        return walk.layout
    # CDR may end in up to three bytes that fill it up.
    if not 0 <= len(message) - walk.at <= (3 if cdr else 0):
        raise _Misfit
    return walk.layout


def _defined(types: Types, kind: str) -> Fields:
    if kind not in types:
        raise Undefined(kind)
    return types[kind]


class _Walk:
    """Walks through a message, field by field, and keeps their places."""

    def __init__(self, message: bytes, at: int, order: str, types: Types, aligns: bool) -> None:
        self._message, self._origin, self._types, self._aligns = message, at, types, aligns
        self.at, self.layout = at, _Layout(order)

    def fields(self, fields: Fields, prefix: str, depth: int) -> None:
        for name, (node, says) in fields:
            if node in (_BASE, _NAME):
                self._value(node, says, prefix + name, depth)
            else:
                (inner, kind), count = says
                self._list(inner, kind, count if node == _ARRAY else self._length(), prefix + name, depth)

    def _value(self, node: int, says: object, name: str, depth: int) -> None:
        if node == _NAME:
            kind = str(says)
            if kind in TIMES:
                self._place(name, TIME_TYPE, 4, 8)
            elif depth > DEEPEST:
                raise Undefined(kind)
            else:
                self.fields(_defined(self._types, kind), f"{name}.", depth + 1)
            return
        assert isinstance(says, tuple)
        kind = says[0]
        if kind == "string":
            self._skip(self._length())
        elif kind in NUMBERS:
            size = int(NUMBERS[kind][1])
            self._place(name, NUMBERS[kind], size, size)
        else:
            raise Undefined(kind)

    def _list(self, node: int, says: object, count: int, name: str, depth: int) -> None:
        if count <= LONGEST_LIST:
            for number in range(count):
                self._value(node, says, f"{name}.{number}", depth)
        elif node == _BASE and isinstance(says, tuple) and says[0] in NUMBERS:
            size = int(NUMBERS[says[0]][1])
            self._align(size)
            self._skip(size * count)
        else:
            raise _Unending

    def _place(self, name: str, number: str, align: int, size: int) -> None:
        self._align(align)
        self.layout.places.append((name, self.at, number))
        self._skip(size)

    def _length(self) -> int:
        self._align(4)
        start = self.at
        self._skip(4)
        content = self._message[start : self.at]
        self.layout.lengths.append((start, content))
        return int.from_bytes(content, "little" if self.layout.order == "<" else "big")

    def _align(self, size: int) -> None:
        if self._aligns:
            self.at += (self._origin - self.at) % size

    def _skip(self, size: int) -> None:
        self.at += size
        if self.at > len(self._message):
            raise _Misfit
