"""The data of a wet check in a recording, and the vehicle's response to each pulse, expected and measured.

The recording gives thruster commands and sensor readings, on the vehicle's clock. A response is a small feature vector
for each pulse and sensor. The expected response comes from the linear model at rest, M nu_dot + D nu + G theta = B T,
including the righting moment, because a roll or pitch after a pulse swings back within seconds. Only the first part of
a response is used, while its sign is certain.
"""

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from statistics import median
from typing import Final

import numpy as np
from pymavlink.dialects.v20 import ardupilotmega as dialect

from bridge.arrays import Array
from bridge.errors import LogError
from bridge.vehicle.coefficients import DAMPINGS, MASSES
from bridge.vehicle.config import GRAVITY_M_S2, Configuration, Vehicle
from bridge.vehicle.thrusters import NEUTRAL_US, Curve, allocation_matrix
from bridge.wire.framing import Frame
from bridge.wire.framing import decode as decode_message
from bridge.wire.readings import decode

OFF_NEUTRAL_US: Final = 15.0
SHORTEST_PULSE_S: Final = 0.3
LONGEST_PULSE_S: Final = 3.0
SENSORS: Final = ("dvl", "imu", "fog")
U32: Final = 1 << 32

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
    """The data of a wet check. `pwm` (n, thrusters) us; in body axes as configured: `velocity` (n, 3) at the DVL's
    transducer, `force` and `rate` (n, 3) of the IMU, `fog` (n, 1) yaw rate. None for a sensor without data."""

    pwm: Series
    velocity: Series | None = None
    force: Series | None = None
    rate: Series | None = None
    fog: Series | None = None

    @property
    def series(self) -> dict[str, Series]:
        """The sensors' data by the names of their features."""
        named = {"dvl": self.velocity, "rate": self.rate, "force": self.force, "fog": self.fog}
        return {name: series for name, series in named.items() if series is not None}


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
    imu = rows.get("imu", [])
    return WetRecord(
        pwm,
        _series(rows.get("dvl", []), slice(0, 3)),
        _series(imu, slice(0, 3)),
        _series(imu, slice(3, 6)),
        _series(rows.get("fog", []), slice(0, 1)),
    )


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
        """Times and pulse widths on the clock of the sensor readings; messages that arrive together count as one
        time."""
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


STEP_S: Final = 0.01
BASELINE_S: Final = 0.8
WINDOWS: Final = {"dvl": (0.5, 1.2), "rate": (0.3, 0.6), "force": (0.1, 0.5), "fog": (0.3, 0.6)}
ADDED_SHARE: Final = (1.3, 1.6, 2.0, 1.6, 1.6, 1.6)  # total over rigid-body mass if the file has no model
DAMPING_TIME_S: Final = 3.0


@dataclass(frozen=True)
class Motion:
    """Simulated responses to one newton from each of n thrusters alone.

    `time_s` (k,) since the pulse began, `nu` (k, n, 6), `force` (k, n, 3) the change of specific force.
    """

    time_s: Array
    nu: Array
    force: Array


def nominal(configuration: Configuration) -> tuple[Array, Array]:
    """Total mass (6,) and linear damping (6,): from the file's model if it has values, otherwise by a rule of thumb."""
    rigid = [configuration.dry_mass_kg] * 3 + list(configuration.inertia_kgm2)
    mass = np.array([configuration.model.get(c.name, rigid[c.dof] * ADDED_SHARE[c.dof]) for c in MASSES])
    damping = [configuration.model.get(c.name, mass[c.dof] / DAMPING_TIME_S) for c in DAMPINGS]
    return mass, np.array(damping)


def motion(configuration: Configuration, on_s: float, lag_s: float) -> Motion:
    """Simulate the linear responses to a pulse of `on_s`."""
    mass, damping = nominal(configuration)
    righting = np.zeros(6)
    weight = configuration.dry_mass_kg * GRAVITY_M_S2
    righting[3:5] = configuration.centre_of_gravity_below_buoyancy_m * weight
    wrench = allocation_matrix(configuration).T
    count = round((on_s + 1.0) / STEP_S)
    nu, force = np.zeros((count, *wrench.shape)), np.zeros((count, len(wrench), 3))
    angle, thrust = np.zeros_like(wrench), 0.0
    for k in range(1, count):
        wanted = 1.0 if k * STEP_S <= on_s else 0.0
        thrust += (wanted - thrust) * min(1.0, STEP_S / max(lag_s, STEP_S))
        nu_dot = (wrench * thrust - damping * nu[k - 1] - righting * angle) / mass
        nu[k] = nu[k - 1] + STEP_S * nu_dot
        angle += STEP_S * nu[k]
        # Specific force: acceleration minus gravity as seen by the tilted body, without its value at rest.
        force[k] = nu_dot[:, :3]
        force[k, :, 0] += GRAVITY_M_S2 * angle[:, 4]
        force[k, :, 1] -= GRAVITY_M_S2 * angle[:, 3]
    return Motion(np.linspace(0.0, (count - 1) * STEP_S, count), nu, force)


def expected(
    vehicle: Vehicle, configuration: Configuration, curve: Curve, pulses: Sequence[Pulse]
) -> dict[str, Array]:
    """Response (pulses, thrusters, k) by sensor that each pulse would cause if it drove each thruster, forwards."""
    levers = {
        slot: np.array(device.mounting.position_m) for slot, device in vehicle.sensors.present().items()
    }
    on_s = float(np.median([pulse.end_s - pulse.start_s for pulse in pulses]))
    moved = motion(configuration, on_s, vehicle.thrust_curve.lag_s)
    linear, turning = moved.nu[..., :3], moved.nu[..., 3:]
    series = {
        "dvl": linear + np.cross(turning, levers.get("dvl", np.zeros(3))),
        "rate": turning,
        "force": moved.force + np.cross(np.gradient(turning, STEP_S, axis=0), levers.get("imu", np.zeros(3))),
        "fog": turning[..., 2:],
    }
    thrust_n = curve.thrust([pulse.pwm_us for pulse in pulses])
    features = {}
    for name, value in series.items():
        start_s, end_s = WINDOWS[name]
        inside = (moved.time_s >= start_s) & (moved.time_s < end_s)
        features[name] = thrust_n[:, None, None] * value[inside].mean(axis=0)
    return features


def measured(record: WetRecord, pulses: Sequence[Pulse]) -> dict[str, Array]:
    """Response (pulses, k) by sensor that each pulse caused; NaN if the sensor has no data around a pulse."""
    return {
        name: np.array([_felt(series, pulse, WINDOWS[name]) for pulse in pulses])
        for name, series in record.series.items()
    }


def noise(record: WetRecord, pulses: Sequence[Pulse]) -> dict[str, Array]:
    """Standard deviation (k,) by sensor of the same features at rest before the first pulse; 0 if too short.

    It contains the sensor's noise and any other motion of the vehicle.
    """
    std = {}
    for name, series in record.series.items():
        first_s, last_s = series.time_s[0] + BASELINE_S, pulses[0].start_s - WINDOWS[name][1]
        still = [Pulse(0, start_s, start_s, 0.0) for start_s in np.arange(first_s, last_s, 0.25)]
        felt = np.array([_felt(series, pulse, WINDOWS[name]) for pulse in still])
        felt = felt[np.isfinite(felt).all(axis=1)] if len(still) else felt
        std[name] = felt.std(axis=0) if len(felt) > 3 else np.zeros(series.value.shape[1])
    return std


def _felt(series: Series, pulse: Pulse, window: tuple[float, float]) -> Array:
    before = series.mean(pulse.start_s - BASELINE_S, pulse.start_s)
    during = series.mean(pulse.start_s + window[0], pulse.start_s + window[1])
    if before is None or during is None:
        return np.full(series.value.shape[1], np.nan)
    return np.asarray(during - before)


def rest_force(record: WetRecord, pulses: Sequence[Pulse]) -> Array | None:
    """Specific force (3,) before the first pulse; None if the IMU has no data."""
    if record.force is None or not pulses:
        return None
    return record.force.mean(-np.inf, pulses[0].start_s)
