"""Xsens MTData2: byte layout of a frame's data, worked out once for each sequence of items and then reused.

A device repeats the same few sequences, so a frame costs a single `struct` call and a comparison of its headers.
"""

import struct
from collections.abc import Callable
from dataclasses import dataclass
from operator import itemgetter
from typing import Any

TEMPERATURE = 0x0810
PACKET_COUNTER = 0x1020
SAMPLE_TIME_FINE = 0x1060
QUATERNION = 0x2010
ACCELERATION = 0x4020
RATE_OF_TURN = 0x8020
MAGNETIC_FIELD = 0xC020
STATUS_WORD = 0xE020

Values = tuple[Any, ...]
Numbers = Callable[[Values], Any]  # a tuple of floats, as long as the quantity

_VECTOR_LENGTHS = {TEMPERATURE: 1, QUATERNION: 4, ACCELERATION: 3, RATE_OF_TURN: 3, MAGNETIC_FIELD: 3}
_INTEGERS = {PACKET_COUNTER: "H", SAMPLE_TIME_FINE: "I", STATUS_WORD: "I"}
_TYPE_MASK, _FRAME_MASK, _PRECISION_MASK = 0xFFF0, 0x000C, 0x0003
# by precision: struct code of a number, and how many unpacked values it takes
_PRECISIONS = (("f", 1), ("i", 1), ("Ih", 2), ("d", 1))  # f32, FP12.20, FP16.32, f64


@dataclass(frozen=True, slots=True)
class Layout:
    """Readers for a sequence of items; None for quantities that it does not hold.

    Readers of type `Numbers` take the unpacked values to a vector; `packet`, `ticks`, `status` are indices into them.
    """

    unpack: Callable[[bytes], Values]
    headers_of: Callable[[Values], Any]
    headers: Any
    acceleration: Numbers | None
    rate: Numbers | None
    quaternion: Numbers | None
    magnetic_field: Numbers | None
    temperature: Numbers | None
    packet: int | None
    ticks: int | None
    status: int | None
    frames: frozenset[int]


def layout_of(data: bytes) -> Layout | None:
    """Return the layout of `data`; None if it is not a complete sequence of (identifier, size, payload) items.

    A known quantity whose size does not fit it also gives None, as for a broken sequence.
    """
    code, position, at = ">", 0, 0
    header_positions: list[int] = []
    numbers: dict[int, Numbers] = {}
    integers: dict[int, int] = {}
    frames: set[int] = set()
    while at + 3 <= len(data):
        identifier, size = data[at] << 8 | data[at + 1], data[at + 2]
        kind = identifier & _TYPE_MASK
        header_positions.append(position)
        position += 1
        if kind in _VECTOR_LENGTHS:
            number_code, width = _PRECISIONS[identifier & _PRECISION_MASK]
            count = _VECTOR_LENGTHS[kind]
            item_code = number_code * count
            numbers[kind] = _reader(identifier & _PRECISION_MASK, position, position + width * count)
            position += width * count
            if kind == QUATERNION:
                frames.add(identifier & _FRAME_MASK)
        elif kind in _INTEGERS:
            item_code = _INTEGERS[kind]
            integers[kind] = position
            position += 1
        else:
            item_code = f"{size}x"
        if struct.calcsize(">" + item_code) != size:
            return None
        code += "3s" + item_code
        at += 3 + size
    if at != len(data) or not header_positions:
        return None
    unpack, headers_of = struct.Struct(code).unpack, itemgetter(*header_positions)
    return Layout(
        unpack=unpack,
        headers_of=headers_of,
        headers=headers_of(unpack(data)),
        acceleration=numbers.get(ACCELERATION),
        rate=numbers.get(RATE_OF_TURN),
        quaternion=numbers.get(QUATERNION),
        magnetic_field=numbers.get(MAGNETIC_FIELD),
        temperature=numbers.get(TEMPERATURE),
        packet=integers.get(PACKET_COUNTER),
        ticks=integers.get(SAMPLE_TIME_FINE),
        status=integers.get(STATUS_WORD),
        frames=frozenset(frames),
    )


def encode_numbers(precision: int, numbers: tuple[float, ...]) -> bytes:
    """Encode numbers in the precision of an identifier's low two bits: 0 f32, 1 FP12.20, 2 FP16.32, 3 f64."""
    if precision == 1:
        return struct.pack(f">{len(numbers)}i", *(round(v * 2**20) for v in numbers))
    if precision == 2:
        # The fraction goes first, then the whole part.
        scaled = (round(v * 2**32) for v in numbers)
        return b"".join(struct.pack(">Ih", s & 0xFFFFFFFF, s >> 32) for s in scaled)
    return struct.pack(f">{len(numbers)}{_PRECISIONS[precision][0]}", *numbers)


def _reader(precision: int, start: int, stop: int) -> Numbers:
    if precision == 1:
        return lambda values: tuple(v / 2**20 for v in values[start:stop])
    if precision == 2:
        return lambda values: tuple(values[i + 1] + values[i] / 2**32 for i in range(start, stop, 2))
    return itemgetter(slice(start, stop))
