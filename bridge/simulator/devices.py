"""The simulated devices: what the body does, as the byte streams that the real sensors write.

Each device looks at a stretch of the body's motion and gives chunks of bytes with their simulated arrival:
the moment measured, plus the latency that the vehicle file states for the device.
"""

import math
from dataclasses import dataclass
from datetime import UTC, datetime
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from bridge.sensors.kvh1750 import encode_kvh1750
from bridge.sensors.mounting import mounting_matrix, quaternion_of
from bridge.sensors.wayfinder import encode_wayfinder
from bridge.sensors.xsens import encode_xsens
from bridge.simulator.motion import moments, motion_at
from bridge.simulator.noise import NoiseLevels
from bridge.simulator.plant import Stretch
from bridge.vehicle.config import Device

Array = NDArray[np.float64]
BOTTOM_M = 8.0
BEAM_COSINE = math.cos(math.radians(30))
ENU_OF_NED = np.array([[0.0, 1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, -1.0]])


@dataclass(frozen=True, slots=True)
class Chunk:
    """Bytes of the device in a slot of the vehicle file, the last of which arrives at `time_s`."""

    slot: str
    time_s: float
    data: bytes


@dataclass(frozen=True)
class Surroundings:
    """What every device may know of the world."""

    noise: NoiseLevels
    gravity_m_s2: float
    density_kg_m3: float
    surface_pressure_pa: float
    unix_at_boot_s: float


class SimulatedDevice(Protocol):
    """One device aboard."""

    def chunks(self, stretch: Stretch) -> list[Chunk]:
        """What it writes of what it saw after the start of the stretch, up to its end."""
        ...


class SimulatedDvl:
    """Velocity over the bottom and range, at 10 Hz unless the vehicle file says otherwise."""

    def __init__(self, slot: str, device: Device, world: Surroundings, rng: np.random.Generator) -> None:
        self._slot, self._latency_s, self._world, self._rng = slot, device.latency_s, world, rng
        self._rate_hz = device.rate_hz or 10.0
        self._arm = np.array(device.mounting.position_m)
        self._to_body = np.array(mounting_matrix(device.mounting))

    def chunks(self, stretch: Stretch) -> list[Chunk]:
        chunks = []
        motion = motion_at(stretch, moments(stretch, self._rate_hz))
        velocities = motion.velocity_at(self._arm) @ self._to_body
        for time_s, velocity, depth_m in zip(motion.time_s, velocities, motion.position[:, 2], strict=True):
            data = self._ping(float(time_s), velocity, BOTTOM_M - float(depth_m))
            chunks.append(Chunk(self._slot, float(time_s) + self._latency_s, data))
        return chunks

    def _ping(self, time_s: float, velocity: Array, altitude_m: float) -> bytes:
        noise = self._world.noise
        draw = self._rng.standard_normal(8)
        lost = self._rng.random() < noise.dvl_dropout
        x, y, z = (velocity + noise.dvl_m_s * draw[:3]).tolist()
        a, b, c, d = (altitude_m / BEAM_COSINE + noise.dvl_range_m * draw[3:7]).tolist()
        when = datetime.fromtimestamp(self._world.unix_at_boot_s + time_s, UTC)
        nan = math.nan
        if lost:
            return encode_wayfinder((nan, nan, nan), (a, nan, nan, nan), nan, when, error_velocity=nan)
        error_velocity = noise.dvl_m_s * float(draw[7])
        return encode_wayfinder((x, y, z), (a, b, c, d), altitude_m, when, error_velocity=error_velocity)


class SimulatedImu:
    """Specific force, rate of turn and attitude, at 100 Hz unless the vehicle file says otherwise."""

    def __init__(self, slot: str, device: Device, world: Surroundings, rng: np.random.Generator) -> None:
        self._slot, self._latency_s, self._world, self._rng = slot, device.latency_s, world, rng
        self._rate_hz = device.rate_hz or 100.0
        self._arm = np.array(device.mounting.position_m)
        self._to_body = np.array(mounting_matrix(device.mounting))
        self._turn = _outer(quaternion_of(ENU_OF_NED), quaternion_of(self._to_body))
        self._bias = world.noise.gyro_bias_rad_s * rng.standard_normal(3)
        self._packet = 0

    def chunks(self, stretch: Stretch) -> list[Chunk]:
        noise, draw = self._world.noise, self._rng.standard_normal
        motion = motion_at(stretch, moments(stretch, self._rate_hz))
        shape = motion.rate.shape
        force = motion.specific_force_at(self._arm, self._world.gravity_m_s2) @ self._to_body
        force += noise.accelerometer_m_s2 * draw(shape)
        rate = motion.rate @ self._to_body + self._bias + noise.gyro_rad_s * draw(shape)
        attitude = motion.attitude @ self._turn.T + 0.5 * noise.attitude_rad * draw((shape[0], 4))
        attitude /= np.sqrt((attitude * attitude).sum(axis=1))[:, None]
        chunks = []
        rows = zip(motion.time_s.tolist(), force.tolist(), rate.tolist(), attitude.tolist(), strict=True)
        for time_s, f, r, q in rows:
            chunks.append(
                Chunk(self._slot, time_s + self._latency_s, encode_xsens(self._packet, time_s, f, r, q))
            )
            self._packet += 1
        return chunks


def _outer(left: tuple[float, ...], right: tuple[float, ...]) -> Array:
    """(4, 4) that takes a quaternion q to left q right."""
    a, b, c, d = left
    w, x, y, z = right
    before = np.array([[a, -b, -c, -d], [b, a, -d, c], [c, d, a, -b], [d, -c, b, a]])
    after = np.array([[w, -x, -y, -z], [x, w, z, -y], [y, -z, w, x], [z, y, -x, w]])
    turn: Array = before @ after
    return turn


class SimulatedDsp1750:
    """The mean rate about z over each frame's own millisecond; a tick's frames come in one chunk."""

    def __init__(self, slot: str, device: Device, world: Surroundings, rng: np.random.Generator) -> None:
        self._slot, self._latency_s, self._world, self._rng = slot, device.latency_s, world, rng
        self._rate_hz = device.rate_hz or 1000.0
        self._sign = math.copysign(1.0, mounting_matrix(device.mounting)[2][2])
        self._bias = world.noise.fog_bias_rad_s * float(rng.standard_normal())
        self._count = 0

    def chunks(self, stretch: Stretch) -> list[Chunk]:
        ends = moments(stretch, self._rate_hz)
        if not len(ends):
            return []
        # Between physics steps the rate is straight, and a frame lies within one: its mean is its middle.
        rate = np.interp(ends - 0.5 / self._rate_hz, stretch.time_s, stretch.state[:, 12])
        noise = self._world.noise
        measured = self._sign * rate + self._bias + noise.fog_rad_s * self._rng.standard_normal(len(ends))
        data = encode_kvh1750(measured, self._count)
        self._count += len(ends)
        return [Chunk(self._slot, float(ends[-1]) + self._latency_s, data)]
