"""Speed controllers with BLHeli_32 / KISS serial telemetry: 10 bytes at 115200 baud, sent as answers to requests.

Source: ArduPilot's AP_BLHeli. Temperature u8 (deg C), voltage u16 (0.01 V), current u16 (0.01 A), consumption u16
(mAh), electrical rpm / 100 u16, big-endian, and CRC-8 (polynomial 0x07). Mechanical rpm is the electrical rpm times 2
/ poles.

An answer has no start byte and identifies neither its controller nor the direction of rotation. The parser therefore
counts along: the requester asks 0, 1 .. n-1 in turn, and a broken answer still takes its turn. An answer may start
after a pause of 1 ms; within a burst only the CRC finds it. The turn of a controller that stays silent shows in the
time alone, so it is counted only where the rate of requests is known.
"""

import struct
from dataclasses import replace

from fastcrc import crc8

from bridge.sensors.samples import EscSample, Sample

FRAME = 10

_BODY = struct.Struct(">B4H")
_PAUSE_S = 1e-3
_BYTE_S = 10 / 115200
_RPM_PER_FIELD = 200.0  # electrical rpm / 100, and two poles a pair
# Ports are read in steps, so an answer may seem late or early by half a turn; the requester's clock has its own rate.
_CLEARLY, _PULL = 0.6, 0.05
# An 8-bit CRC lets 1 in 256 broken answers pass, so values beyond any such controller are refused as well.
_HOTTEST_C, _MOST_V, _MOST_A = 150.0, 80.0, 300.0


def encode_esc(
    rpm: float,
    poles: int,
    voltage_v: float,
    current_a: float,
    temperature_c: float,
    consumed_mah: float = 0.0,
) -> bytes:
    """Encode an answer as the controller writes it; the sign of `rpm` is lost."""
    body = _BODY.pack(
        round(temperature_c),
        round(voltage_v * 100),
        round(current_a * 100),
        round(consumed_mah),
        round(abs(rpm) * poles / _RPM_PER_FIELD),
    )
    return body + bytes((crc8.smbus(body),))


class EscParser:
    """Parses the answers of `count` controllers on one line, asked in turn; motors with `poles` magnets.

    rate_hz: of the requests to all of them together; 0 if it is unknown.
    """

    def __init__(self, count: int, poles: int = 14, latency_s: float = 0.0, rate_hz: float = 0.0) -> None:
        self._count = count
        self._rate_hz = rate_hz
        self._asked_s: float | None = None
        self._poles = poles
        self._latency_s = latency_s
        self._buffer = bytearray()
        self._starts: list[int] = []  # offsets in the buffer where a pause was
        self._skipped = 0
        self._next = 0
        self._last_s: float | None = None

    def feed(self, data: bytes, time_s: float) -> list[Sample]:
        """Return the samples of the answers that `data` completes."""
        if not data:
            return []
        begun_s = time_s - (len(data) - 1) * _BYTE_S
        if self._buffer and self._last_s is not None and begun_s - self._last_s > _PAUSE_S:
            self._starts.append(len(self._buffer))
        self._last_s = time_s
        self._buffer += data
        samples: list[EscSample] = []
        first = self._next
        while len(self._buffer) >= FRAME:
            frame = bytes(self._buffer[:FRAME])
            if crc8.smbus(frame[:-1]) != frame[-1]:
                self._drop(self._starts[0] if self._starts else 1)
                continue
            temperature_c, centivolts, centiamps, _, field = _BODY.unpack_from(frame)
            voltage_v, current_a = centivolts / 100, centiamps / 100
            if temperature_c > _HOTTEST_C or not 0 < voltage_v <= _MOST_V or current_a > _MOST_A:
                self._drop(FRAME)
                continue
            self._cut(FRAME)
            samples.append(
                EscSample(
                    time_s=time_s - self._latency_s,
                    index=self._turn(),
                    rpm=field * _RPM_PER_FIELD / self._poles,
                    voltage_v=voltage_v,
                    current_a=current_a,
                )
            )
        return self._in_turn(samples, first, time_s)

    def _in_turn(self, samples: list[EscSample], first: int, time_s: float) -> list[Sample]:
        """The samples of answers that came at a time, with the turns of silent controllers before them counted.

        first: the turn that was next before them. Of several answers at once nothing tells where one was missing, so
        they are left out; their number makes up for turns that a late reading of the port counted too many.
        """
        if not self._rate_hz or not samples:
            return [*samples]
        if self._asked_s is None:
            self._asked_s = time_s
            return [*samples]
        behind = (time_s - self._asked_s) * self._rate_hz - (self._next - first)
        silent = round(behind) if abs(behind) > _CLEARLY else 0
        self._next += silent
        self._asked_s += (self._next - first + _PULL * (behind - silent)) / self._rate_hz
        if silent == 0:
            return [*samples]
        if len(samples) > 1:
            return []
        return [replace(samples[0], index=(samples[0].index + silent) % self._count)]

    def _turn(self) -> int:
        """Return the controller of this answer: three or more skipped bytes before it count as a broken answer."""
        turn = self._next + (self._skipped + 7) // FRAME
        self._skipped = 0
        self._next = turn + 1
        return turn % self._count

    def _drop(self, size: int) -> None:
        if size:
            self._skipped += size
            self._cut(size)

    def _cut(self, size: int) -> None:
        del self._buffer[:size]
        self._starts = [start - size for start in self._starts if start > size]
