"""Xsens MTi-300 and related IMUs: Xbus frames with MTData2, big-endian.

Source: the open drivers ethz-asl/ethzasl_xsens_driver and einride/xsens-go (MIT). A frame is FA, bus id, message id,
length (255: two more length bytes), data, and a checksum that makes all bytes after FA sum to zero. MTData2 is a
sequence of (identifier u16, size u8, payload); the two low bits of an identifier give the precision of its numbers. A
device repeats the same few sequences, so the layout of each is worked out once: a frame costs a single `struct` call
and a comparison of its headers.

Axes: those of the sensor, right-handed with z up when level, so that at rest the z of specific force is +9.81.
Attitude is sensor to earth in ENU (x east, y north, z up).

Time: arrival less the configured latency; with a `ClockFit` the device's own sample clock (0.1 ms) removes the jitter
of the arrivals.
"""

import struct
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from operator import itemgetter
from typing import Any

from bridge.arrays import Quaternion, Vector3
from bridge.sensors.samples import ImuSample, Sample
from bridge.sensors.streams import ClockFit, Frames, starting

TEMPERATURE = 0x0810
PACKET_COUNTER = 0x1020
SAMPLE_TIME_FINE = 0x1060
QUATERNION = 0x2010
ACCELERATION = 0x4020
RATE_OF_TURN = 0x8020
STATUS_BYTE = 0xE010
STATUS_WORD = 0xE020

Values = tuple[Any, ...]
Numbers = Callable[[Values], Any]  # a tuple of floats, as long as the quantity

_VECTOR_LENGTHS = {TEMPERATURE: 1, QUATERNION: 4, ACCELERATION: 3, RATE_OF_TURN: 3}
_INTEGERS = {PACKET_COUNTER: "H", SAMPLE_TIME_FINE: "I", STATUS_BYTE: "B", STATUS_WORD: "I"}
_TYPE_MASK, _FRAME_MASK, _PRECISION_MASK = 0xFFF0, 0x000C, 0x0003
# by precision: struct code of a number, and how many unpacked values it takes
_PRECISIONS = (("f", 1), ("i", 1), ("Ih", 2), ("d", 1))  # f32, FP12.20, FP16.32, f64


@dataclass(frozen=True, slots=True)
class Layout:
    """Readers for a sequence of items, by quantity.

    `vectors` take the unpacked values to a vector, `integers` are indices into them; `frames` are those of its
    attitudes.
    """

    unpack: Callable[[bytes], Values]
    headers_of: Callable[[Values], Any]
    headers: Any
    vectors: Mapping[int, Numbers]
    integers: Mapping[int, int]
    frames: frozenset[int]


def layout_of(data: bytes) -> Layout | None:
    """Return the layout of `data`; None if it is not a complete sequence of (identifier, size, payload) items.

    A known quantity whose size does not fit it also gives None, as for a broken sequence.
    """
    code, position, at = ">", 0, 0
    header_positions: list[int] = []
    vectors: dict[int, Numbers] = {}
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
            vectors[kind] = _reader(identifier & _PRECISION_MASK, position, position + width * count)
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
    return Layout(unpack, headers_of, headers_of(unpack(data)), vectors, integers, frozenset(frames))


def _reader(precision: int, start: int, stop: int) -> Numbers:
    if precision == 1:
        return lambda values: tuple(v / 2**20 for v in values[start:stop])
    if precision == 2:
        return lambda values: tuple(values[i + 1] + values[i] / 2**32 for i in range(start, stop, 2))
    return itemgetter(slice(start, stop))


MT_DATA2 = 0x36

ORIENTATION_VALID = 1 << 1
CLIPPED = 0x3F00  # bits of the status word: an axis of acceleration or rate of turn is beyond its range
SAMPLE_TIME_TICK_S = 1e-4

_PREAMBLE = b"\xfa\xff"
_STARTS = starting(_PREAMBLE)
_MAX_DATA = 2048
_LARGEST = 1e4  # m/s2, rad/s: beyond any sensor of this kind; garbage read as floats often exceeds it
_MOST_LAYOUTS = 32
_ENU = frozenset((0,))
_SUGGESTED = struct.Struct(">4B HBH HBI HB3f HB3f HB4f HBI")


def encode_message(message: int, data: bytes = b"") -> bytes:
    """Encode a complete Xbus frame."""
    length = bytes((len(data),)) if len(data) < 255 else b"\xff" + struct.pack(">H", len(data))
    body = bytes((0xFF, message)) + length + data
    return b"\xfa" + body + bytes((-sum(body) & 0xFF,))


def encode_mtdata2(items: Iterable[tuple[int, bytes]]) -> bytes:
    """Encode an MTData2 frame of (identifier, payload) items."""
    data = b"".join(struct.pack(">HB", identifier, len(payload)) + payload for identifier, payload in items)
    return encode_message(MT_DATA2, data)


def encode_xsens(
    packet: int,
    sample_time_s: float,
    specific_force: Vector3,
    rate: Vector3,
    attitude: Quaternion,
    status: int = ORIENTATION_VALID,
) -> bytes:
    """Encode a frame of the suggested output set: counter, time, acceleration, rate, quaternion, status word."""
    ticks = round(sample_time_s / SAMPLE_TIME_TICK_S) & 0xFFFFFFFF
    body = _SUGGESTED.pack(
        0xFA, 0xFF, MT_DATA2, _SUGGESTED.size - 4,
        PACKET_COUNTER, 2, packet & 0xFFFF,
        SAMPLE_TIME_FINE, 4, ticks,
        ACCELERATION, 12, *specific_force,
        RATE_OF_TURN, 12, *rate,
        QUATERNION, 16, *attitude,
        STATUS_WORD, 4, status,
    )  # fmt: skip
    return body + bytes((0xFA - sum(body) & 0xFF,))


class XsensParser:
    """Parses acceleration, rate of turn and, if sent, temperature and attitude.

    An attitude that is not in ENU, not of length 1, or flagged by the device is left out. A frame whose acceleration or
    rate of turn the device flags as clipped gives no sample.
    """

    def __init__(self, latency_s: float = 0.0, clock: ClockFit | None = None) -> None:
        self._latency_s = latency_s
        self._clock = clock
        self._stream = Frames(_STARTS, self._size, _checksum_ok)
        self._layouts: dict[int, Layout] = {}
        self._ticks = 0

    def feed(self, data: bytes, time_s: float) -> list[Sample]:
        """Return the samples of the frames that `data` completes."""
        samples: list[Sample] = []
        for frame in self._stream.feed(data):
            if frame[2] == MT_DATA2:
                sample = self._sample(frame[6 if frame[3] == 0xFF else 4 : -1], time_s)
                if sample is not None:
                    samples.append(sample)
        return samples

    def _size(self, buffer: bytearray, at: int) -> int | None:
        have = len(buffer) - at
        if have < 4:
            return None
        if buffer[at + 3] != 0xFF:
            return 5 + buffer[at + 3]
        if have < 6:
            return None
        length = buffer[at + 4] << 8 | buffer[at + 5]
        return 7 + length if length <= _MAX_DATA else 0

    def _sample(self, data: bytes, time_s: float) -> ImuSample | None:
        layout = self._layouts.get(len(data))
        if layout is not None:
            values = layout.unpack(data)
        if layout is None or layout.headers_of(values) != layout.headers:
            layout = layout_of(data)
            if layout is None:
                return None
            if len(self._layouts) >= _MOST_LAYOUTS:
                self._layouts.clear()
            self._layouts[len(data)] = layout
            values = layout.unpack(data)
        vectors, integers = layout.vectors, layout.integers
        if ACCELERATION not in vectors or RATE_OF_TURN not in vectors:
            return None
        fx, fy, fz = vectors[ACCELERATION](values)
        p, q, r = vectors[RATE_OF_TURN](values)
        if not abs(fx) + abs(fy) + abs(fz) + abs(p) + abs(q) + abs(r) < _LARGEST:
            return None
        if STATUS_WORD in integers and values[integers[STATUS_WORD]] & CLIPPED:
            return None
        if self._clock is not None and SAMPLE_TIME_FINE in integers:
            self._ticks += (values[integers[SAMPLE_TIME_FINE]] - self._ticks) & 0xFFFFFFFF
            time_s = self._clock.time_of(self._ticks, time_s)
        return ImuSample(
            time_s - self._latency_s,
            (fx, fy, fz),
            (p, q, r),
            self._attitude(layout, values),
            vectors[TEMPERATURE](values)[0] if TEMPERATURE in vectors else None,
        )

    def _attitude(self, layout: Layout, values: Values) -> Quaternion | None:
        if QUATERNION not in layout.vectors or layout.frames != _ENU:
            return None
        # The byte holds the lowest bits of the word.
        given = [layout.integers[kind] for kind in (STATUS_BYTE, STATUS_WORD) if kind in layout.integers]
        w, x, y, z = layout.vectors[QUATERNION](values)
        if (
            not all(values[at] & ORIENTATION_VALID for at in given)
            or not 0.98 < w * w + x * x + y * y + z * z < 1.02
        ):
            return None
        return w, x, y, z


def _checksum_ok(frame: bytes) -> bool:
    return not sum(frame[1:]) & 0xFF
