"""Simulated devices: the body's motion to the byte streams of the real sensors.

Each takes a stretch of the body's motion and returns chunks of bytes with their simulated arrival times: the moment
of measurement plus the latency that the vehicle file gives for the device.
"""

import math
from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass
from datetime import UTC, datetime

import numpy as np

from bridge.arrays import NAN3, Array, Vector3
from bridge.attitude import quaternion_of
from bridge.clock import SimulatedClock
from bridge.sensors.bar30 import Bar30, FakeBar30
from bridge.sensors.drivers import speaks_tcp
from bridge.sensors.esc import encode_esc
from bridge.sensors.kvh1750 import encode_kvh1750
from bridge.sensors.kvh1760 import encode_kvh1760
from bridge.sensors.mounting import mounting_matrix
from bridge.sensors.samples import Arrival, GnssSample
from bridge.sensors.ublox import FIX_3D, NO_FIX, encode_nav_pvt
from bridge.sensors.waterlink import encode_waterlink_json, encode_waterlink_serial
from bridge.sensors.wayfinder import encode_wayfinder
from bridge.sensors.xsens import encode_xsens
from bridge.simulator.plant import Motion, Stretch, moments, motion_at
from bridge.simulator.truth import NoiseLevels
from bridge.vehicle.config import Device, ThrustCurve, Water
from bridge.vehicle.thrusters import shaft_speed

BOTTOM_M = 8.0
GYRO_HZ = 1000.0
BEAM_COSINE = math.cos(math.radians(30))
ENU_OF_NED = np.array([[0.0, 1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, -1.0]])


@dataclass(frozen=True)
class Surroundings:
    """The properties of the world that every device may use."""

    noise: NoiseLevels
    water: Water
    thrust_curve: ThrustCurve
    unix_at_boot_s: float


class SimulatedDevice(ABC):
    """A simulated device on the vehicle, which measures `usual_hz` times a second unless the vehicle file says
    otherwise."""

    usual_hz = 10.0

    def __init__(self, slot: str, device: Device, world: Surroundings, rng: np.random.Generator) -> None:
        self._slot, self._device, self._world, self._rng = slot, device, world, rng
        self._noise, self._latency_s = world.noise, device.latency_s
        self._rate_hz = device.rate_hz or self.usual_hz
        self._arm = np.array(device.mounting.position_m)
        self._to_body = np.array(mounting_matrix(device.mounting))

    @abstractmethod
    def arrivals(self, stretch: Stretch) -> list[Arrival]:
        """Return the device's data for the moments after the start of the stretch, up to its end."""

    def _motion(self, stretch: Stretch) -> Motion:
        """The body's motion at the moments at which the device measures."""
        return motion_at(stretch, moments(stretch, self._rate_hz))


@dataclass(frozen=True, slots=True)
class Ping:
    """A DVL measurement in the DVL's own axes; NaN for lost values. Times are boot time."""

    valid_s: float
    sent_s: float
    velocity: Vector3
    error_velocity: float
    ranges: tuple[float, float, float, float]
    altitude_m: float


class SimulatedDvl(SimulatedDevice):
    """Velocity over the bottom and ranges."""

    def __init__(
        self,
        slot: str,
        device: Device,
        world: Surroundings,
        rng: np.random.Generator,
        encode: Callable[[Ping], bytes],
    ) -> None:
        super().__init__(slot, device, world, rng)
        self._encode = encode

    def arrivals(self, stretch: Stretch) -> list[Arrival]:
        chunks = []
        motion = self._motion(stretch)
        velocities = motion.velocity_at(self._arm) @ self._to_body
        for time_s, velocity, depth_m in zip(motion.time_s, velocities, motion.position[:, 2], strict=True):
            ping = self._ping(float(time_s), velocity, BOTTOM_M - float(depth_m))
            chunks.append(Arrival(self._slot, ping.sent_s, self._encode(ping)))
        return chunks

    def _ping(self, time_s: float, velocity: Array, altitude_m: float) -> Ping:
        noise, draw = self._noise, self._rng.standard_normal(8)
        sent_s = time_s + self._latency_s
        x, y, z = (velocity + noise.dvl_m_s * draw[:3]).tolist()
        a, b, c, d = (altitude_m / BEAM_COSINE + noise.dvl_range_m * draw[3:7]).tolist()
        if self._rng.random() < noise.dvl_dropout:
            return Ping(time_s, sent_s, NAN3, math.nan, (a, math.nan, math.nan, math.nan), math.nan)
        return Ping(time_s, sent_s, (x, y, z), noise.dvl_m_s * float(draw[7]), (a, b, c, d), altitude_m)


def wayfinder(slot: str, device: Device, world: Surroundings, rng: np.random.Generator) -> SimulatedDvl:

    def encode(ping: Ping) -> bytes:
        when = datetime.fromtimestamp(world.unix_at_boot_s + ping.valid_s, UTC)
        return encode_wayfinder(
            ping.velocity, ping.ranges, ping.altitude_m, when, error_velocity=ping.error_velocity
        )

    return SimulatedDvl(slot, device, world, rng, encode)


def a50(slot: str, device: Device, world: Surroundings, rng: np.random.Generator) -> SimulatedDvl:
    """A Water Linked A50: JSON over TCP, sentences over a serial port."""
    write = encode_waterlink_json if speaks_tcp(device) else encode_waterlink_serial

    def encode(ping: Ping) -> bytes:
        valid_us, sent_us = (round(1e6 * (world.unix_at_boot_s + t)) for t in (ping.valid_s, ping.sent_s))
        return write(ping.velocity, ping.altitude_m, world.noise.dvl_m_s, ping.ranges, valid_us, sent_us)

    return SimulatedDvl(slot, device, world, rng, encode)


class SimulatedImu(SimulatedDevice):
    """Specific force, rate of turn and attitude."""

    usual_hz = 100.0

    def __init__(self, slot: str, device: Device, world: Surroundings, rng: np.random.Generator) -> None:
        super().__init__(slot, device, world, rng)
        self._turn = _outer(quaternion_of(ENU_OF_NED), quaternion_of(self._to_body))
        self._bias = world.noise.gyro_bias_rad_s * rng.standard_normal(3)
        self._packet = 0

    def arrivals(self, stretch: Stretch) -> list[Arrival]:
        noise, draw = self._noise, self._rng.standard_normal
        motion = self._motion(stretch)
        shape = motion.rate.shape
        force = motion.specific_force_at(self._arm, self._world.water.gravity_m_s2) @ self._to_body
        force += noise.accelerometer_m_s2 * draw(shape)
        rate = motion.rate @ self._to_body + self._bias + noise.gyro_rad_s * draw(shape)
        attitude = motion.attitude @ self._turn.T + 0.5 * noise.attitude_rad * draw((shape[0], 4))
        attitude /= np.sqrt((attitude * attitude).sum(axis=1))[:, None]
        chunks = []
        rows = zip(motion.time_s.tolist(), force.tolist(), rate.tolist(), attitude.tolist(), strict=True)
        for time_s, f, r, q in rows:
            data = encode_xsens(self._packet, time_s, f, r, q)
            chunks.append(Arrival(self._slot, time_s + self._latency_s, data))
            self._packet += 1
        return chunks


def _outer(left: tuple[float, ...], right: tuple[float, ...]) -> Array:
    """Matrix (4, 4) that maps a quaternion q to left q right."""
    a, b, c, d = left
    w, x, y, z = right
    before = np.array([[a, -b, -c, -d], [b, a, -d, c], [c, d, a, -b], [d, -c, b, a]])
    after = np.array([[w, -x, -y, -z], [x, w, z, -y], [y, -z, w, x], [z, y, -x, w]])
    turn: Array = before @ after
    return turn


class SimulatedGyro(SimulatedDevice):
    """The mean rate about z over each frame's period.

    The frames of a stretch come in a single chunk. `encode` takes their rates and the running count of the first.
    """

    usual_hz = GYRO_HZ

    def __init__(
        self,
        slot: str,
        device: Device,
        world: Surroundings,
        rng: np.random.Generator,
        encode: Callable[[Array, int], bytes],
    ) -> None:
        super().__init__(slot, device, world, rng)
        self._sign = math.copysign(1.0, self._to_body[2, 2])
        self._bias = world.noise.fog_bias_rad_s * float(rng.standard_normal())
        self._encode = encode
        self._count = 0

    def arrivals(self, stretch: Stretch) -> list[Arrival]:
        ends = moments(stretch, self._rate_hz)
        if not len(ends):
            return []
        # The rate is linear between physics steps, and a millisecond fits into a step, so its mean is its middle value.
        rate = np.interp(ends - 0.5 / self._rate_hz, stretch.time_s, stretch.state[:, 12])
        noise = self._noise.fog_rad_s * self._rng.standard_normal(len(ends))
        data = self._encode(self._sign * rate + self._bias + noise, self._count)
        self._count += len(ends)
        return [Arrival(self._slot, float(ends[-1]) + self._latency_s, data)]


def dsp1750(slot: str, device: Device, world: Surroundings, rng: np.random.Generator) -> SimulatedGyro:
    return SimulatedGyro(slot, device, world, rng, encode_kvh1750)


def dsp1760(slot: str, device: Device, world: Surroundings, rng: np.random.Generator) -> SimulatedGyro:
    """A KVH DSP-1760 in its default format: angles turned since the previous frame."""
    period_s = 1 / (device.rate_hz or GYRO_HZ)

    def encode(rates: Array, first: int) -> bytes:
        return b"".join(encode_kvh1760(r * period_s, first + i) for i, r in enumerate(rates.tolist()))

    return SimulatedGyro(slot, device, world, rng, encode)


WATER_C = 15.0
ESC_C = 30.0
ANTENNA_M = 0.25  # height above the body's origin: it is out of the water when the vehicle floats
ORIGIN_DEG = (44.03, 11.27)  # Bilancino Lake, where the paper's vehicle dived
EARTH_M = 6_371_000.0
# A T200 at 16 V draws 24.3 A for 51.4 N (Blue Robotics, 2019); power is proportional to thrust to the 3/2.
AMPERES_PER_N15 = 24.3 / 51.4**1.5


class SimulatedBar30(SimulatedDevice):
    """The real driver on a bus with a fake sensor."""

    def __init__(self, slot: str, device: Device, world: Surroundings, rng: np.random.Generator) -> None:
        super().__init__(slot, device, world, rng)
        self._bus = FakeBar30(temperature_c=WATER_C)
        self._driver = Bar30(self._bus, lambda _: None)

    def arrivals(self, stretch: Stretch) -> list[Arrival]:
        water, motion = self._world.water, self._motion(stretch)
        measured = []
        for time_s, depth_m in zip(motion.time_s.tolist(), motion.depth_of(self._arm).tolist(), strict=True):
            pressure = water.pressure_pa(max(depth_m, 0.0))
            self._bus.pressure_pa = pressure + self._noise.pressure_pa * self._rng.standard_normal()
            sample = self._driver.measure(SimulatedClock(time_s))
            if sample is not None:
                measured.append(Arrival(self._slot, time_s + self._latency_s, sample=sample))
        return measured


class SimulatedEscs(SimulatedDevice):
    """The speed controllers of all thrusters, polled in turn."""

    usual_hz = 80.0

    def __init__(self, slot: str, device: Device, world: Surroundings, rng: np.random.Generator) -> None:
        super().__init__(slot, device, world, rng)
        self._asked = 0

    def arrivals(self, stretch: Stretch) -> list[Arrival]:
        curve, thrust = self._world.thrust_curve, stretch.turned_n
        speeds = 60 * shaft_speed(curve, thrust)
        speeds *= 1 + self._noise.rpm_share * self._rng.standard_normal(len(thrust))
        currents = AMPERES_PER_N15 * np.abs(thrust) ** 1.5
        answers = []
        for time_s in moments(stretch, self._rate_hz).tolist():
            i = self._asked % len(thrust)
            data = encode_esc(
                float(speeds[i]), self._device.poles, curve.voltage_v, float(currents[i]), ESC_C
            )
            answers.append(Arrival(self._slot, time_s + self._latency_s, data))
            self._asked += 1
        return answers


class SimulatedUblox(SimulatedDevice):
    """NAV-PVT: a fix while the antenna is out of the water, none below."""

    usual_hz = 1.0

    def arrivals(self, stretch: Stretch) -> list[Arrival]:
        chunks = []
        motion = self._motion(stretch)
        speeds = motion.earth_velocity().tolist()
        for time_s, place, speed in zip(
            motion.time_s.tolist(), motion.position.tolist(), speeds, strict=True
        ):
            data = encode_nav_pvt(self._fix(time_s, place, speed), round(1000 * time_s))
            chunks.append(Arrival(self._slot, time_s + self._latency_s, data))
        return chunks

    def _fix(self, time_s: float, place: list[float], speed: list[float]) -> GnssSample:
        draw = self._rng.standard_normal(5).tolist()
        if place[2] > ANTENNA_M:
            return GnssSample(time_s, NO_FIX, *(math.nan,) * 6, 0)
        noise = self._noise
        north_m, east_m, up_m = (
            at + noise.gnss_m * d for at, d in zip((*place[:2], -place[2]), draw, strict=False)
        )
        north, east = (v + noise.gnss_m_s * d for v, d in zip(speed[:2], draw[3:], strict=True))
        latitude = ORIGIN_DEG[0] + math.degrees(north_m / EARTH_M)
        longitude = ORIGIN_DEG[1] + math.degrees(east_m / EARTH_M) / math.cos(math.radians(ORIGIN_DEG[0]))
        motion = math.hypot(north, east), math.atan2(east, north)
        return GnssSample(time_s, FIX_3D, latitude, longitude, up_m, noise.gnss_m, *motion, 9)
