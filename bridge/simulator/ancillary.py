"""Simulated pressure sensor, speed controllers and satellite receiver."""

import math

import numpy as np

from bridge.clock import SimulatedClock
from bridge.sensors.bar30 import Bar30, FakeBar30
from bridge.sensors.esc import encode_esc
from bridge.sensors.samples import GnssSample
from bridge.sensors.ublox import FIX_3D, NO_FIX, encode_nav_pvt
from bridge.simulator.motion import moments, motion_at
from bridge.simulator.plant import Stretch
from bridge.simulator.world import Chunk, Measured, Surroundings
from bridge.vehicle.config import Device
from bridge.vehicle.thrusters import shaft_speed

WATER_C = 15.0
ESC_C = 30.0
ANSWERS_HZ = 80.0
ANTENNA_M = 0.25  # height above the body's origin: it is out of the water when the vehicle floats
ORIGIN_DEG = (44.03, 11.27)  # Bilancino Lake, where the paper's vehicle dived
EARTH_M = 6_371_000.0
# A T200 at 16 V draws 24.3 A for 51.4 N (Blue Robotics, 2019); power is proportional to thrust to the 3/2.
AMPERES_PER_N15 = 24.3 / 51.4**1.5


class SimulatedBar30:
    """The real driver on a bus with a fake sensor, polled at 10 Hz unless the vehicle file says otherwise."""

    def __init__(self, slot: str, device: Device, world: Surroundings, rng: np.random.Generator) -> None:
        self._slot, self._latency_s, self._world, self._rng = slot, device.latency_s, world, rng
        self._rate_hz = device.rate_hz or 10.0
        self._arm = np.array(device.mounting.position_m)
        self._bus = FakeBar30(temperature_c=WATER_C)
        self._driver = Bar30(self._bus, lambda _: None)

    def arrivals(self, stretch: Stretch) -> list[Measured]:
        water = self._world.water
        motion = motion_at(stretch, moments(stretch, self._rate_hz))
        measured = []
        for time_s, depth_m in zip(motion.time_s.tolist(), motion.depth_of(self._arm).tolist(), strict=True):
            pressure = 100 * water.surface_pressure_hpa
            pressure += water.density_kg_m3 * water.gravity_m_s2 * max(depth_m, 0.0)
            self._bus.pressure_pa = pressure + self._world.noise.pressure_pa * self._rng.standard_normal()
            sample = self._driver.measure(SimulatedClock(time_s))
            if sample is not None:
                measured.append(Measured(self._slot, time_s + self._latency_s, sample))
        return measured


class SimulatedEscs:
    """The speed controllers of all thrusters, polled in turn, 80 answers a second unless the vehicle file says
    otherwise."""

    def __init__(self, slot: str, device: Device, world: Surroundings, rng: np.random.Generator) -> None:
        self._slot, self._device, self._world, self._rng = slot, device, world, rng
        self._rate_hz = device.rate_hz or ANSWERS_HZ
        self._asked = 0
        self._consumed_mah = np.zeros(0)

    def arrivals(self, stretch: Stretch) -> list[Chunk]:
        curve, thrust = self._world.thrust_curve, stretch.turned_n
        speeds = 60 * shaft_speed(curve, thrust)
        speeds *= 1 + self._world.noise.rpm_share * self._rng.standard_normal(len(thrust))
        currents = AMPERES_PER_N15 * np.abs(thrust) ** 1.5
        if not len(self._consumed_mah):
            self._consumed_mah = np.zeros(len(thrust))
        self._consumed_mah += currents * (stretch.time_s[-1] - stretch.time_s[0]) / 3.6
        answers = []
        for _ in moments(stretch, self._rate_hz):
            i = self._asked % len(thrust)
            answers.append(
                encode_esc(
                    float(speeds[i]),
                    self._device.poles,
                    curve.voltage_v,
                    float(currents[i]),
                    ESC_C,
                    float(self._consumed_mah[i]),
                )
            )
            self._asked += 1
        if not answers:
            return []
        return [Chunk(self._slot, float(stretch.time_s[-1]) + self._device.latency_s, b"".join(answers))]


class SimulatedUblox:
    """NAV-PVT at 1 Hz unless the vehicle file says otherwise: a fix while the antenna is out of the water, none
    below."""

    def __init__(self, slot: str, device: Device, world: Surroundings, rng: np.random.Generator) -> None:
        self._slot, self._latency_s, self._noise, self._rng = slot, device.latency_s, world.noise, rng
        self._rate_hz = device.rate_hz or 1.0

    def arrivals(self, stretch: Stretch) -> list[Chunk]:
        chunks = []
        motion = motion_at(stretch, moments(stretch, self._rate_hz))
        speeds = motion.earth_velocity().tolist()
        for time_s, place, speed in zip(
            motion.time_s.tolist(), motion.position.tolist(), speeds, strict=True
        ):
            data = encode_nav_pvt(self._fix(time_s, place, speed), round(1000 * time_s))
            chunks.append(Chunk(self._slot, time_s + self._latency_s, data))
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
