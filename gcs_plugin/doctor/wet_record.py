"""The wet check in a recording: thruster commands and sensor readings on the vehicle's clock, and the pulses in it."""

import math
from collections.abc import Iterable
from dataclasses import dataclass
from statistics import median
from typing import Final

import numpy as np
from pymavlink.dialects.v20 import ardupilotmega as dialect

from bridge.arrays import Array
from bridge.errors import LogError
from bridge.vehicle.thrusters import NEUTRAL_US
from bridge.wire.framing import Frame
from bridge.wire.framing import decode as decode_message
from bridge.wire.readings import decode

OFF_NEUTRAL_US: Final = 15.0
SHORTEST_PULSE_S: Final = 0.3
LONGEST_PULSE_S: Final = 3.0
SENSORS: Final = ("dvl", "imu", "fog")
U32: Final = 1 << 32

FEATURES: Final = {
    "dvl": ("dvl", slice(0, 3)),
    "force": ("imu", slice(0, 3)),
    "rate": ("imu", slice(3, 6)),
    "fog": ("fog", slice(0, 1)),
}
"""What is felt of a pulse: the signal and its columns. Velocity at the DVL's transducer, specific force and rate of the
IMU, yaw rate of the gyro."""

Rows = list[tuple[float, tuple[float, ...]]]


@dataclass(frozen=True)
class Series:
    """Samples in order of time: `time_s` (n,) boot time of validity, `value` (n, k) in SI units."""

    time_s: Array
    value: Array

    def mean(self, start_s: float, end_s: float) -> Array | None:
        """Mean (k,) in [start_s, end_s); None without a sample."""
        inside = (self.time_s >= start_s) & (self.time_s < end_s)
        return np.asarray(self.value[inside].mean(axis=0)) if inside.any() else None

    def between(self, start_s: float, end_s: float) -> "Series":
        inside = (self.time_s >= start_s) & (self.time_s < end_s)
        return Series(self.time_s[inside], self.value[inside])


@dataclass(frozen=True)
class WetRecord:
    """The data of a wet check: `pwm` (n, thrusters) us, and `series` of the FEATURES of each sensor with data, in body
    axes as configured."""

    pwm: Series
    series: dict[str, Series]


@dataclass(frozen=True, slots=True)
class Pulse:
    """A stretch with a single thruster off neutral: `thruster` counts from 0."""

    thruster: int
    start_s: float
    end_s: float
    pwm_us: float


def record_of(frames: Iterable[Frame], thrusters: int) -> WetRecord:
    """Extract the wet check from a vehicle's frames. Raises LogError if the thruster commands are missing.

    If the autopilot sends the commands and a companion the sensor readings, the commands are put on the companion's
    clock.
    """
    rows: dict[str, Rows] = {}
    servos = _Servos(thrusters)
    for frame in frames:
        reading = decode(frame)
        if reading is not None and reading.signal in ("pwm", *SENSORS):
            rows.setdefault(reading.signal, []).append((reading.time_s, reading.values))
            if reading.signal in SENSORS:
                servos.sensor_reported(frame, reading.time_s)
        elif frame.message_id == dialect.MAVLINK_MSG_ID_SERVO_OUTPUT_RAW:
            servos.take(frame)
    pwm = _series(rows.get("pwm") or servos.rows(), slice(0, thrusters))
    if pwm is None or pwm.value.shape[1] < thrusters:
        raise LogError(
            f"the recording holds no commands of {thrusters} thrusters (ACTUATOR_OUTPUT_STATUS or "
            "SERVO_OUTPUT_RAW); record again"
        )
    recorded = {name: _series(rows.get(signal, []), columns) for name, (signal, columns) in FEATURES.items()}
    return WetRecord(pwm, {name: series for name, series in recorded.items() if series is not None})


class _Servos:
    """ArduPilot's SERVO_OUTPUT_RAW of output port 0, whose 32-bit microseconds wrap around after 71.6 min."""

    def __init__(self, thrusters: int) -> None:
        self._thrusters = thrusters
        self._rows: Rows = []
        self._wraps_us = self._last_us = 0
        self._sensor: tuple[int, float] | None = None
        self._ahead_s: list[float] = []

    def sensor_reported(self, frame: Frame, time_s: float) -> None:
        """Note the sender and time of a sensor reading."""
        self._sensor = frame.component, time_s

    def take(self, frame: Frame) -> None:
        """Take a SERVO_OUTPUT_RAW."""
        message = decode_message(frame)
        if message is None or message.port != 0:
            return
        if message.time_usec + U32 // 2 < self._last_us:
            self._wraps_us += U32
        self._last_us = message.time_usec
        time_s = (self._last_us + self._wraps_us) / 1e6
        values = tuple(float(getattr(message, f"servo{i}_raw")) for i in range(1, self._thrusters + 1))
        self._rows.append((time_s, values))
        if self._sensor is not None and self._sensor[0] != frame.component:
            self._ahead_s.append(time_s - self._sensor[1])

    def rows(self) -> Rows:
        """Times and pulse widths on the clock of the sensor readings; messages that arrive together share a time."""
        ahead_s = median(self._ahead_s) if self._ahead_s else 0.0
        return [(time_s - ahead_s, values) for time_s, values in self._rows]


def _series(rows: Rows, columns: slice) -> Series | None:
    good = sorted((t, v[columns]) for t, v in rows if all(map(math.isfinite, (t, *v[columns]))))
    if not good:
        return None
    time_s = np.array([t for t, _ in good])
    first = np.concatenate([[True], np.diff(time_s) > 0])
    return Series(time_s[first], np.array([v for _, v in good], dtype=float)[first])


def find_pulses(pwm: Series) -> list[Pulse]:
    """Find the stretches with a single thruster off neutral; a command holds until the time of the next."""
    off = np.abs(pwm.value - NEUTRAL_US) > OFF_NEUTRAL_US
    lone = np.where(off.sum(axis=1) == 1, off.argmax(axis=1), -1)
    pulses: list[Pulse] = []
    start = 0
    for index in range(1, len(lone) + 1):
        if index < len(lone) and lone[index] == lone[start]:
            continue
        # Only a stretch that begins and ends within the record has known edges.
        if lone[start] >= 0 and start > 0 and index < len(lone):
            edges = (pwm.time_s[start], pwm.time_s[index])
            level = float(np.median(pwm.value[start:index, lone[start]]))
            if SHORTEST_PULSE_S <= edges[1] - edges[0] <= LONGEST_PULSE_S:
                pulses.append(Pulse(int(lone[start]), float(edges[0]), float(edges[1]), level))
        start = index
    return pulses
