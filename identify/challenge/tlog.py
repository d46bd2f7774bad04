"""A simulated dive as the bytes of a `.tlog`, in the messages of the telemetry contract."""

import math
import struct
from collections.abc import Iterator

from bridge.wire.framing import Encoder
from bridge.wire.readings import Reading, encode
from identify.dive import Dive, Signal

UNIX_AT_BOOT_S = 1_790_000_000.0
"""Date of the vehicle's boot in a simulated recording, in 2026."""

_STAMP = struct.Struct(">Q")
"""Time of a record in a `.tlog`: Unix time in us."""

_AS_RECORDED = (
    "tau_pid",
    "tau_ff",
    "tau_cmd",
    "nu_fb",
    "nu_ref",
    "pwm",
    "rpm",
    "fog",
    "altitude",
    "ff_mode",
    "veh_cfg",
)
"""Signals of a dive whose rows are the values of the reading of that name."""


def tlog_of(dive: Dive, unix_at_boot_s: float = UNIX_AT_BOOT_S) -> bytes:
    """The bytes of a `.tlog` that holds the readings of a dive, each stamped with its own time."""
    encoder = Encoder(1, 1)
    records: list[bytes] = []
    for time_s, reading in sorted(_readings(dive, unix_at_boot_s), key=lambda pair: pair[0]):
        records.append(_STAMP.pack(round((unix_at_boot_s + time_s) * 1e6)) + encoder.frame(*encode(reading)))
    return b"".join(records)


def _readings(dive: Dive, unix_at_boot_s: float) -> Iterator[tuple[float, Reading]]:
    for name in _AS_RECORDED:
        for time_s, row in _rows(getattr(dive, name)):
            yield time_s, Reading(name, time_s, row)
    for time_s, row in _rows(dive.velocity):
        yield time_s, Reading("dvl", time_s, (*row, math.nan))
    if dive.gyro is not None and dive.specific_force is not None:
        for (time_s, rates), (_, force) in zip(_rows(dive.gyro), _rows(dive.specific_force), strict=True):
            yield time_s, Reading("imu", time_s, (*force, *rates, math.nan))
    for time_s, row in _rows(dive.attitude):
        yield time_s, Reading("attitude", time_s, (*row, 0.0, 0.0, 0.0))
    for time_s, row in _rows(dive.pressure):
        yield time_s, Reading("pressure", time_s, (*row, math.nan))
    for time_s, row in _rows(dive.voltage):
        yield time_s, Reading("battery", time_s, (*row, math.nan))
        yield time_s, Reading("clock", time_s, (unix_at_boot_s + time_s,))
    for time_s, row in _rows(dive.armed):
        yield time_s, Reading("alive", time_s, (row[0], 12.0, 0.0))


def _rows(signal: Signal | None) -> Iterator[tuple[float, tuple[float, ...]]]:
    if signal is not None:
        for time_s, row in zip(signal.time_s.tolist(), signal.value.tolist(), strict=True):
            yield time_s, tuple(row)
