"""Teledyne Wayfinder DVL: binary packets over a serial line, little-endian.

Source: Teledyne's open driver (github Teledyne-Marine/Wayfinder, MIT) for the layout, the maker's "Binary Interface
Packet Protocol" page for the framing. A data packet carries two checksums, of the structure and of the packet; both
must match.

Instrument axes: x from beam 1 to beam 2, y from beam 4 to beam 3, z away from the bottom; the velocity is that of the
instrument over the bottom.

The DVL has lock if x, y and z are all finite. The error velocity, the redundancy of four beams over three, may be
NaN: three beams give a velocity but no error. A packet with an infinite or impossible velocity or error gives no
sample.

Time: the packet holds the DVL's own clock, but that has a resolution of 10 ms and no time zone, and is set by hand to
the second. A sample's time is therefore the arrival of the packet less the configured latency.
"""

import math
import struct
from datetime import datetime

from bridge.arrays import Vector3
from bridge.sensors.samples import DvlSample, Sample
from bridge.sensors.streams import Frames, starting

EXIT_COMMAND_MODE = 0x00000010  # starts pinging

INSTRUMENT = 1
"""Coordinates; 0 would be those of the beams, 2 of the ship, 3 of the earth."""

_PACKET_START = b"\xaa\x10\x01"
_STARTS = starting(_PACKET_START)
_OVERHEAD = 7  # start, version, id, length and checksum
_APPLICATION_VERSION = 2
_COMMAND, _DATA = 3, 5
_MAX_PACKET = 4096  # far above every known packet; limits the bytes that a false length can hold back
_FASTEST_M_S = 20.0
_FARTHEST_M = 1000.0
_SPEED_OF_SOUND_M_S = 1500.0

# id, version, size; type, subtype, firmware; date; ms; coordinates; velocity, error; ranges, mean, speed of
# sound; status, BIT count, BIT code; voltages, current; serial number, reserved, checksum
_DATA_LAYOUT = struct.Struct("<BBI6B6BHB4f6fHBB3f6s4x")
_OLD_DATA_SIZE = 79  # structure version 0x10 may end before the serial number
_DATA_VERSIONS = (0x10, 0x11)
_VELOCITY_AND_RANGES = struct.Struct("<B9f")
_COORDINATES_AT = 20


def encode_packet(kind: int, payload: bytes) -> bytes:
    """Wrap the payload of application type `kind` (3 command, 4 response, 5 data) in a complete packet."""
    application = struct.pack("<BBH", _APPLICATION_VERSION, kind, len(payload) + 4) + payload
    body = _PACKET_START + struct.pack("<H", len(application) + _OVERHEAD) + application
    return body + struct.pack("<H", sum(body) & 0xFFFF)


def encode_command(command: int) -> bytes:
    """Encode a command to the DVL; `encode_command(EXIT_COMMAND_MODE)` starts its pinging."""
    return encode_packet(_COMMAND, struct.pack("<I", command))


def encode_wayfinder(
    velocity: Vector3,
    ranges: tuple[float, float, float, float],
    altitude_m: float,
    when: datetime,
    *,
    error_velocity: float = 0.0,
    coordinates: int = INSTRUMENT,
    structure_version: int = 0x11,
) -> bytes:
    """Encode a data packet as the device writes it; NaN marks invalid values.

    velocity in m/s, instrument axes; ranges and altitude in m; `when` in UTC.
    """
    structure = bytearray(
        _DATA_LAYOUT.pack(
            0xAA, structure_version, _DATA_LAYOUT.size,
            76, 0, 1, 0, 0, 24,
            when.year - 2000, when.month, when.day, when.hour, when.minute, when.second,
            when.microsecond // 1000,
            coordinates, *velocity, error_velocity,
            *ranges, altitude_m, _SPEED_OF_SOUND_M_S,
            0, 0, 0,
            24.0, 23.5, 0.25,
            b"001234" if structure_version >= 0x11 else bytes(6),
        )
    )  # fmt: skip
    structure[-2:] = struct.pack("<H", sum(structure[:-2]) & 0xFFFF)
    return encode_packet(_DATA, bytes(structure))


class WayfinderParser:
    """Parses velocity in instrument axes; the mean range to the bottom serves as the altitude.

    A DVL set to the coordinates of beams, ship or earth gives no sample, because its numbers are not x y z.
    """

    def __init__(self, latency_s: float = 0.0) -> None:
        self._latency_s = latency_s
        self._stream = Frames(_STARTS, self._size, _checksum_ok)

    def feed(self, data: bytes, time_s: float) -> list[Sample]:
        """Return the samples of the packets that `data` completes."""
        samples = (self._application(packet[5:-2], time_s) for packet in self._stream.feed(data))
        return [sample for sample in samples if sample is not None]

    def _size(self, buffer: bytearray, at: int) -> int | None:
        if len(buffer) - at < 5:
            return None
        length = int.from_bytes(buffer[at + 3 : at + 5], "little")
        if not _OVERHEAD + 4 <= length <= _MAX_PACKET:
            return 0
        if len(buffer) - at < 9:
            return None
        if int.from_bytes(buffer[at + 7 : at + 9], "little") != length - _OVERHEAD:
            return 0
        return length

    def _application(self, application: bytes, time_s: float) -> DvlSample | None:
        if application[:2] == bytes((_APPLICATION_VERSION, _DATA)):
            return self._data(application[4:], time_s)
        return None

    def _data(self, structure: bytes, time_s: float) -> DvlSample | None:
        if len(structure) < _OLD_DATA_SIZE or int.from_bytes(structure[2:6], "little") != len(structure):
            return None
        if not _checksum_ok(structure) or structure[1] not in _DATA_VERSIONS:
            return None
        coordinates, *values = _VELOCITY_AND_RANGES.unpack_from(structure, _COORDINATES_AT)
        if coordinates != INSTRUMENT:
            return None
        too_fast = any(abs(v) > _FASTEST_M_S for v in values[:4])
        if too_fast or any(v < 0 or v > _FARTHEST_M for v in values[4:]):
            return None
        return DvlSample(
            time_s=time_s - self._latency_s,
            velocity=(values[0], values[1], values[2]),
            sigma=math.nan,
            altitude_m=values[8],
        )


def _checksum_ok(data: bytes) -> bool:
    return sum(data[:-2]) & 0xFFFF == int.from_bytes(data[-2:], "little")
