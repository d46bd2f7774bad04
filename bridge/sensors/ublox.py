"""u-blox 7 GNSS receiver: UBX NAV messages or NMEA sentences, distinguished here and decoded by pyubx2 and pynmeagps.

Source: u-blox 7 receiver description (protocol version 14). A fix comes from NAV-PVT or, while there is none, from GGA
and RMC of the same epoch.

Without a fix, position and motion are NaN. NMEA gives no accuracy: its sigma is NaN. Time: arrival less the
configured latency.
"""

import math
import operator
import re
import struct
from functools import reduce
from typing import Any, Final

from pynmeagps import NMEAMessageError, NMEAParseError, NMEAReader, NMEATypeError
from pyubx2 import UBXMessageError, UBXParseError, UBXReader, UBXTypeError

from bridge.sensors.samples import GnssSample, Sample
from bridge.sensors.streams import Frames

NO_FIX, FIX_2D, FIX_3D, FIX_DGPS, RTK_FLOAT, RTK_FIXED = range(1, 7)  # MAVLink's GPS_FIX_TYPE

_UBX_START: Final = b"\xb5\x62"
_MAX_PAYLOAD: Final = 1024
_MAX_SENTENCE: Final = 120  # NMEA allows 82, but receivers exceed it
_PVT: Final = b"\x01\x07"
_PVT_BYTES: Final = (84, 92)
_SENTENCE: Final = re.compile(rb"\$[ -~]{0,%d}\r?\n" % _MAX_SENTENCE)
_UNFINISHED: Final = re.compile(rb"\$[ -~]{0,%d}\r?" % _MAX_SENTENCE)
_START: Final = re.compile(rb"\$|\xb5\x62|\xb5\Z")
_FIELDS: Final = {b"GGA": 15, b"RMC": 12}  # at least, with the name
_NMEA_FIXES: Final = {1: FIX_3D, 2: FIX_DGPS, 4: RTK_FIXED, 5: RTK_FLOAT}
_KNOT_M_S: Final = 1852 / 3600
_HIGHEST_M, _FASTEST_M_S = 20_000.0, 600.0
_SILENCE_S: Final = 5.0  # silence of NAV-PVT after which sentences are used again


def encode_ubx(message: bytes, payload: bytes) -> bytes:
    """Encode a UBX frame; `message` is the message class and id (2 bytes)."""
    body = message + struct.pack("<H", len(payload)) + payload
    return _UBX_START + body + _fletcher(body)


def encode_nav_pvt(sample: GnssSample, epoch_ms: int) -> bytes:
    """Encode a sample as NAV-PVT (84 bytes, as a u-blox 7 sends it); NaN is sent as zero, without a date."""
    fix = {NO_FIX: 0, FIX_2D: 2}.get(sample.fix_type, 3)
    flags = (fix > 0) | (sample.fix_type == FIX_DGPS) << 1
    height_mm = _scaled(sample.altitude_m, 1e3)
    speed_mm_s = _scaled(sample.speed_m_s, 1e3)
    north = _scaled(sample.speed_m_s * math.cos(sample.course_rad), 1e3)
    east = _scaled(sample.speed_m_s * math.sin(sample.course_rad), 1e3)
    payload = struct.pack(
        "<I 8x I i 2B x B 2i 2i 2I 4i i 2I H 6x",
        epoch_ms,
        0, 0,
        fix, flags, sample.satellites,
        _scaled(sample.longitude_deg, 1e7), _scaled(sample.latitude_deg, 1e7),
        height_mm, height_mm,
        _scaled(sample.horizontal_sigma_m, 1e3), 0,
        north, east, 0, speed_mm_s,
        _scaled(math.degrees(sample.course_rad) % 360, 1e5),
        0, 0, 100,
    )  # fmt: skip
    return encode_ubx(_PVT, payload)


def encode_nmea(body: str) -> bytes:
    """Encode a sentence around `body` (`GPGGA,...`), with its checksum."""
    return b"$%s*%02X\r\n" % (body.encode("ascii"), _xor(body.encode("ascii")))


_Place = tuple[float, float, float, float]  # latitude and longitude (deg), altitude and sigma (m)


class UbloxParser:
    """Parses the receiver's fixes; sentences beside NAV-PVT are not taken."""

    def __init__(self, latency_s: float = 0.0) -> None:
        self._latency_s = latency_s
        self._stream = Frames(_START, self._size, _checksum_ok)
        self._sentences: dict[bytes, Any] = {}
        self._epoch = b""
        self._pvt_s = -math.inf

    def feed(self, data: bytes, time_s: float) -> list[Sample]:
        """Return the samples that the messages in `data` complete."""
        samples = (
            self._ubx(message, time_s) if message.startswith(_UBX_START) else self._nmea(message, time_s)
            for message in self._stream.feed(data)
        )
        return [sample for sample in samples if sample is not None]

    def _size(self, buffer: bytearray, at: int) -> int | None:
        if buffer[at] != _UBX_START[0]:
            sentence = _SENTENCE.match(buffer, at)
            if sentence:
                return sentence.end() - at
            return None if _UNFINISHED.fullmatch(buffer, at) else 0
        if len(buffer) - at < 6:
            return None
        length = int.from_bytes(buffer[at + 4 : at + 6], "little")
        is_odd = buffer[at + 2 : at + 4] == _PVT and length not in _PVT_BYTES
        return 0 if length > _MAX_PAYLOAD or is_odd else length + 8

    def _ubx(self, message: bytes, time_s: float) -> GnssSample | None:
        if message[2:4] != _PVT:
            return None
        try:
            decoded: Any = UBXReader.parse(message)
        except (UBXParseError, UBXMessageError, UBXTypeError):
            return None
        self._pvt_s = time_s
        fix = _ubx_fix(decoded.fixType, decoded.gnssFixOk, decoded.diffSoln)
        place = decoded.lat, decoded.lon, decoded.hMSL / 1e3, decoded.hAcc / 1e3
        return self._fix(time_s, fix, place, (decoded.gSpeed / 1e3, decoded.headMot), decoded.numSV)

    def _nmea(self, message: bytes, time_s: float) -> GnssSample | None:
        kind = message[3:6]
        if kind not in _FIELDS or time_s - self._pvt_s <= _SILENCE_S:
            return None
        fields = message.split(b",")
        try:
            decoded = NMEAReader.parse(message) if len(fields) >= _FIELDS[kind] else None
        except (NMEAParseError, NMEAMessageError, NMEATypeError):
            decoded = None
        if decoded is None:
            return None
        if fields[1] != self._epoch:
            self._epoch, self._sentences = fields[1], {}
        self._sentences[kind] = decoded
        if len(self._sentences) < len(_FIELDS):
            return None
        gga, rmc = self._sentences[b"GGA"], self._sentences[b"RMC"]
        self._sentences = {}
        fix = _NMEA_FIXES.get(_field(gga, "quality"), NO_FIX) if _field(rmc, "status") == "A" else NO_FIX
        place = _number(gga, "lat"), _number(gga, "lon"), _number(gga, "alt"), math.nan
        motion = _number(rmc, "spd") * _KNOT_M_S, _number(rmc, "cog")
        return self._fix(time_s, fix, place, motion, _field(gga, "numSV") or 0)

    def _fix(
        self, time_s: float, fix: int, place: _Place, motion: tuple[float, float], satellites: int
    ) -> GnssSample | None:
        latitude_deg, longitude_deg, altitude_m, sigma_m = place
        speed_m_s, course_deg = motion
        if fix == NO_FIX:
            latitude_deg = longitude_deg = altitude_m = sigma_m = speed_m_s = course_deg = math.nan
        elif not (abs(latitude_deg) <= 90 and abs(longitude_deg) <= 180):
            return None
        return GnssSample(
            time_s - self._latency_s,
            fix,
            latitude_deg,
            longitude_deg,
            altitude_m if abs(altitude_m) <= _HIGHEST_M else math.nan,
            sigma_m,
            speed_m_s if 0 <= speed_m_s <= _FASTEST_M_S else math.nan,
            math.radians(course_deg) if abs(course_deg) <= 360 else math.nan,
            satellites,
        )


def _ubx_fix(fix: int, is_ok: int, is_differential: int) -> int:
    """Convert the receiver's fix (2 is 2D, 3 is 3D, 4 is 3D with dead reckoning) to MAVLink's fix type."""
    if not is_ok or fix not in (2, 3, 4):
        return NO_FIX
    if fix == 2:
        return FIX_2D
    return FIX_DGPS if is_differential else FIX_3D


def _field(decoded: Any, name: str) -> Any:
    """Return a field of a sentence; None if it is absent or empty."""
    value = getattr(decoded, name, "")
    return None if value == "" else value


def _number(decoded: Any, name: str) -> float:
    value = _field(decoded, name)
    return float(value) if isinstance(value, int | float) else math.nan


def _scaled(value: float, by: float) -> int:
    return round(value * by) if math.isfinite(value) else 0


def _checksum_ok(message: bytes) -> bool:
    if message.startswith(_UBX_START):
        return _fletcher(message[2:-2]) == message[-2:]
    body, _, given = message[1:].rstrip(b"\r\n").rpartition(b"*")
    return given == b"%02X" % _xor(body)


def _fletcher(body: bytes) -> bytes:
    a = b = 0
    for byte in body:
        a = (a + byte) & 0xFF
        b = (b + a) & 0xFF
    return bytes((a, b))


def _xor(body: bytes) -> int:
    return reduce(operator.xor, body, 0)
