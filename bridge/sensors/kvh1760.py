"""KVH DSP-1760 fibre-optic gyro and the 1750/1775 IMU family: frames with a header and a CRC, big-endian.

Source: open drivers (github ESA-PRL/drivers-dsp1760, RIVeR-Lab/kvh_driver) and the 1775 IMU's interface document.
Format A has 36 bytes: header, rotation x y z (f32), acceleration x y z (f32), status, sequence 0..127, temperature
(i16), CRC-32/MPEG-2. Format B (40 bytes) has a time stamp of the device (u32) before the status; this is inferred
from open drivers, not from the maker. A single-axis unit uses z. Status bit 2 set: gyro z valid.

Rotation is the angle since the last frame in radians, as `encode_setup` sets it: the device could send a rate instead,
and does not report which of the two it sends.

Time: arrivals fitted over the sequence, as for the DSP-1750.
"""

import math
import struct

import numpy as np
from fastcrc import crc32

from bridge.errors import ConfigError
from bridge.sensors.samples import FogBlock, Sample
from bridge.sensors.streams import ClockFit, Frames, starting

RATES_HZ = (1, 5, 10, 25, 50, 100, 250, 500, 750, 1000)
GYRO_Z_VALID = 1 << 2
RATED_RAD_S = math.radians(490.0)

_PREFIX = b"\xfe\x81\xff"
_STARTS = starting(_PREFIX)
_LAYOUTS = {0x55: struct.Struct(">12x f 12x B B h 4x"), 0x56: struct.Struct(">12x f 12x 4x B B h 4x")}
_SEQUENCES = 128
_PERIOD_TOLERANCE = 0.01


def encode_kvh1760(
    rotation_z: float,
    sequence: int,
    *,
    valid: bool = True,
    temperature_c: float = 20.0,
    stamp: int | None = None,
) -> bytes:
    """Encode a frame of format A, or of format B if a time stamp is given; temperature in 0.01 deg C (C_100)."""
    header = _PREFIX + (b"\x55" if stamp is None else b"\x56")
    vectors = struct.pack(">6f", 0.0, 0.0, rotation_z, 0.0, 0.0, 0.0)
    middle = b"" if stamp is None else struct.pack(">I", stamp & 0xFFFFFFFF)
    end = struct.pack(">BBh", 0x07 if valid else 0x03, sequence % _SEQUENCES, round(temperature_c * 100))
    body = header + vectors + middle + end
    return body + crc32.mpeg_2(body).to_bytes(4, "big")


def encode_setup(rate_hz: int) -> bytes:
    """Commands that set angles, radians and rate. Raises ConfigError for a rate that the device does not support."""
    if rate_hz not in RATES_HZ:
        raise ConfigError(
            f"a DSP-1760 can't send at {rate_hz} Hz; set rate_hz to one of {', '.join(map(str, RATES_HZ))}"
        )
    return f"=config,1\n=rotfmt,delta\n=rotunits,RAD\n=dr,{rate_hz}\n=config,0\n".encode("ascii")


class Kvh1760Parser:
    """Parses rates about z, at most one FogBlock per feed."""

    def __init__(self, rate_hz: float = 1000.0, latency_s: float = 0.0) -> None:
        self._rate_hz = rate_hz
        self._latency_s = latency_s
        self._clock = ClockFit(1.0 / rate_hz, _PERIOD_TOLERANCE)
        self._stream = Frames(_STARTS, self._size, _checksum_ok)
        self._sequence: int | None = None
        self._frames = 0

    def feed(self, data: bytes, time_s: float) -> list[Sample]:
        """Return the frames that `data` completes, as one block."""
        numbers: list[int] = []
        rates: list[float] = []
        valid: list[bool] = []
        for frame in self._stream.feed(data):
            rotation, status, sequence, _temperature = _LAYOUTS[frame[3]].unpack(frame)
            self._count(sequence)
            rate = rotation * self._rate_hz
            if not math.isfinite(rate):
                continue
            numbers.append(self._frames)
            rates.append(rate)
            valid.append(bool(status & GYRO_Z_VALID) and abs(rate) <= RATED_RAD_S)
        if not rates:
            return []
        last_s = self._clock.time_of(numbers[-1], time_s - self._latency_s)
        times = self._clock.times_before(last_s, numbers[-1] - np.array(numbers, dtype=np.float64))
        return [FogBlock(times, np.array(rates), np.array(valid))]

    def _size(self, buffer: bytearray, at: int) -> int | None:
        if len(buffer) - at <= len(_PREFIX):
            return None
        layout = _LAYOUTS.get(buffer[at + len(_PREFIX)])
        return 0 if layout is None else layout.size

    def _count(self, sequence: int) -> None:
        """Advance the frame number, counting missing frames too."""
        if self._sequence is not None:
            self._frames += (sequence - self._sequence - 1) % _SEQUENCES + 1
        self._sequence = sequence


def _checksum_ok(frame: bytes) -> bool:
    return bool(crc32.mpeg_2(frame[:-4]) == int.from_bytes(frame[-4:], "big"))
