"""Water Linked A50 and A125 DVL: JSON reports over TCP (port 16171), or ASCII sentences over a serial line.

Source: Water Linked's documentation of the protocols (github waterlinked/docs, dvl-protocol.md; serial 2.6.x,
json_v3.1). A sentence ends in `*` and two hex digits: CRC-8, polynomial 0x07, of everything before the `*`.

Axes: x forward (the side of the LED), y right, z down.

Time: both forms carry the times of validity (centre of the ping) and of transmission, in microseconds of the DVL's
own clock. Their difference is the age of the report at transmission; a sample's time is its arrival less that age. If
the times are absent or implausible, it is the arrival less the configured latency.
"""

import json
import math
import re
from abc import ABC, abstractmethod
from collections.abc import Sequence
from typing import Any

from fastcrc import crc8

from bridge.arrays import NAN3, Vector3
from bridge.sensors.samples import DvlSample, Sample

_LONGEST_REPORT = 16384
_LONGEST_SENTENCE = 1024
_OLDEST_S = 5.0  # longer than any ping and its processing
_FASTEST_M_S = 20.0
_FARTHEST_M = 1000.0
# float() accepts more (1_0, surrounding blanks, "infinity"), but no device writes these.
_NUMBER = re.compile(rb"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?|[+-]?(nan|inf)")
_COVARIANCES = 9
_SINCE_LAST_MS = 100.0  # in what is encoded: ten reports a second


def encode_sentence(body: str) -> bytes:
    """Encode a serial sentence or command: `body`, its CRC and the end of line."""
    raw = body.encode()
    return raw + b"*%02x\r\n" % crc8.smbus(raw)


def encode_waterlink_json(
    velocity: Vector3, altitude_m: float, sigma: float, ranges: Sequence[float], valid_us: int, sent_us: int
) -> bytes:
    """Encode a velocity report as the device writes it; NaN in `velocity` means lost lock, NaN in `ranges` a lost
    beam."""
    locked = not any(map(math.isnan, velocity))
    beams = [
        {
            "id": i,
            "velocity": 0.0,
            "distance": -1.0 if math.isnan(distance) else distance,
            "rssi": -40.0,
            "nsd": -95.0,
            "beam_valid": not math.isnan(distance),
        }
        for i, distance in enumerate(ranges)
    ]
    report = {
        "time": _SINCE_LAST_MS,
        **dict(zip(("vx", "vy", "vz"), velocity if locked else (0.0, 0.0, 0.0), strict=True)),
        "fom": sigma if locked else 0.0,
        "covariance": [[sigma**2 if locked and i == j else 0.0 for j in range(3)] for i in range(3)],
        "altitude": altitude_m if locked else -1.0,
        "transducers": beams,
        "velocity_valid": locked,
        "status": 0,
        "format": "json_v3.1",
        "type": "velocity",
        "time_of_validity": valid_us,
        "time_of_transmission": sent_us,
    }
    return json.dumps(report).encode() + b"\r\n"


def encode_waterlink_serial(
    velocity: Vector3, altitude_m: float, sigma: float, ranges: Sequence[float], valid_us: int, sent_us: int
) -> bytes:
    """Encode the sentences of a report, a `wru` for each transducer and then `wrz`; NaN as in the JSON report."""
    locked = not any(map(math.isnan, velocity))
    beams = "".join(
        encode_sentence(f"wru,{i},0.000,{-1 if math.isnan(distance) else distance:.2f},-40,-95").decode()
        for i, distance in enumerate(ranges)
    )
    x, y, z = velocity if locked else (0.0, 0.0, 0.0)
    variance = sigma**2 if locked else 0.0
    covariance = ";".join(f"{variance if i % 4 == 0 else 0.0:g}" for i in range(9))
    return beams.encode() + encode_sentence(
        f"wrz,{x:.3f},{y:.3f},{z:.3f},{'y' if locked else 'n'},{altitude_m if locked else -1.0:.2f},"
        f"{sigma if locked else 0.0:.3f},{covariance},{valid_us},{sent_us},{_SINCE_LAST_MS:.2f},0"
    )


class _Lines:
    """Splits bytes into lines of limited length; a longer line is discarded up to its end."""

    def __init__(self, longest: int) -> None:
        self._longest = longest
        self.buffer = bytearray()
        self._discarding = False

    def feed(self, data: bytes) -> list[bytes]:
        *whole, tail = (self.buffer + data.replace(b"\r", b"\n")).split(b"\n")
        lines = []
        for line in whole:
            if self._discarding:
                self._discarding = False
            elif len(line) <= self._longest and line.strip():
                lines.append(bytes(line))
        if not self._discarding and len(tail) > self._longest:
            self._discarding = True
        self.buffer = bytearray() if self._discarding else tail
        return lines


class _Parser(ABC):
    """Parses a line at a time."""

    longest: int

    def __init__(self, latency_s: float = 0.0) -> None:
        self._latency_s = latency_s
        self._lines = _Lines(self.longest)

    def feed(self, data: bytes, time_s: float) -> list[Sample]:
        """Return the samples of the lines that `data` completes."""
        samples = (self._parse(line, time_s) for line in self._lines.feed(data))
        return [sample for sample in samples if sample is not None]

    @abstractmethod
    def _parse(self, line: bytes, time_s: float) -> DvlSample | None: ...

    def _moment_s(self, arrived_s: float, valid_us: float, sent_us: float) -> float:
        """When a report was valid, by its own times of validity and transmission if these are plausible."""
        age_s = (sent_us - valid_us) * 1e-6
        if valid_us > 0 and sent_us > 0 and abs(age_s) <= _OLDEST_S:
            return arrived_s - max(age_s, 0.0)
        return arrived_s - self._latency_s


class WaterlinkJsonParser(_Parser):
    """Parses JSON velocity reports."""

    longest = _LONGEST_REPORT

    def _parse(self, line: bytes, time_s: float) -> DvlSample | None:
        try:
            report = json.loads(line.decode(), parse_constant=_nan)
        except (ValueError, RecursionError):
            report = None
        if isinstance(report, dict) and report.get("type") == "velocity":
            return self._velocity(report, time_s)
        return None

    def _velocity(self, report: dict[str, Any], time_s: float) -> DvlSample | None:
        try:
            locked = report["velocity_valid"]
            numbers = [_number(report[name]) for name in ("vx", "vy", "vz", "fom", "altitude")]
            stamps = [_number(report.get(name, 0)) for name in ("time_of_validity", "time_of_transmission")]
        except (KeyError, TypeError, ValueError, OverflowError):
            locked = None
        if not isinstance(locked, bool):
            return None
        return _sample(self._moment_s(time_s, *stamps), locked, numbers)


class WaterlinkSerialParser(_Parser):
    """Parses serial sentences: each `wrz` gives a sample."""

    longest = _LONGEST_SENTENCE

    def _parse(self, line: bytes, time_s: float) -> DvlSample | None:
        body, star, checksum = line.rpartition(b"*")
        if not star or checksum != b"%02x" % crc8.smbus(body):
            return None
        name, *fields = body.split(b",")
        if name != b"wrz":
            return None
        try:
            return self._velocity(fields, time_s)
        except ValueError:
            return None

    def _velocity(self, fields: list[bytes], time_s: float) -> DvlSample | None:
        x, y, z, valid, altitude, fom, covariance, valid_us, sent_us, since_ms, status = fields
        if valid not in (b"y", b"n"):
            raise ValueError(f"{valid!r} is neither y nor n")
        if len(list(map(_parsed, covariance.split(b";")))) != _COVARIANCES:
            raise ValueError(f"{covariance!r} is not {_COVARIANCES} covariances")
        *numbers, valid_at, sent_at, _, _ = map(
            _parsed, (x, y, z, fom, altitude, valid_us, sent_us, since_ms, status)
        )
        return _sample(self._moment_s(time_s, valid_at, sent_at), valid == b"y", numbers)


def _sample(time_s: float, locked: bool, numbers: Sequence[float]) -> DvlSample | None:
    """Build a sample from vx, vy, vz, figure of merit and altitude; without lock these are ignored, whatever their
    values."""
    x, y, z, sigma, altitude_m = numbers
    if not locked:
        return DvlSample(time_s, NAN3, math.nan, math.nan)
    if not all(abs(speed) <= _FASTEST_M_S for speed in (x, y, z)):
        return None
    return DvlSample(
        time_s,
        (x, y, z),
        sigma if 0 <= sigma < math.inf else math.nan,
        altitude_m if 0 <= altitude_m <= _FARTHEST_M else math.nan,
    )


def _parsed(field: bytes) -> float:
    if not _NUMBER.fullmatch(field):
        raise ValueError(f"{field!r} is no number")
    return float(field)


def _number(value: Any) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise TypeError(f"{value!r} is no number")
    return float(value)


def _nan(_literal: str) -> float:
    return math.nan
