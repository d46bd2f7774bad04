"""A flown dive as a stock autopilot's `.tlog`: only ArduSub's messages, in its units and at its rates, frames lost."""

import gzip
import struct
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from pymavlink.dialects.v20 import ardupilotmega as dialect

from bench.field.autopilot import VelocityFilter, estimated, reckoned
from bench.field.dive import EACH, STEP_S
from bench.field.mission import TICK_S
from bench.field.simulate import Flown, Sensors
from bridge.vehicle.config import GRAVITY_M_S2, Water
from bridge.wire.framing import Encoder

Array = NDArray[np.float64]

UNIX_US = 1_760_000_000_000_000
BOOT_S = 47
"""Boot time at the beginning of the recording, s."""

FAST, SLOW, SECOND = 1, 2, 20
"""Ticks between messages of 20, 10 and 1 Hz."""

DELAY_US = {"fast": 4000, "slow": 6000}
MODE_ALT_HOLD = 2
_STAMP = struct.Struct(">Q")


@dataclass(frozen=True)
class Told:
    """Contents of the messages, SI units, a row per message.

    Fast: attitude (n, 6) roll pitch yaw and rates, pwm (n, k), force (n, 3), gyro (n, 3); slow: position (m, 3),
    velocity (m, 3) NED, depth (m,); once a second: supply (s, 2).
    """

    attitude: Array
    pwm: Array
    force: Array
    gyro: Array
    position: Array
    velocity: Array
    depth: Array
    supply: Array


def euler(state: Array) -> Array:
    """Roll, pitch, yaw (n, 3) of states (n, STATES)."""
    w, x, y, z = state[:, 3:7].T
    return np.column_stack(
        [
            np.arctan2(2 * (y * z + w * x), 1 - 2 * (x * x + y * y)),
            np.arcsin(np.clip(2 * (w * y - x * z), -1.0, 1.0)),
            np.arctan2(2 * (x * y + w * z), 1 - 2 * (y * y + z * z)),
        ]
    )


def down(state: Array) -> Array:
    """The unit vector down (n, 3), in body axes."""
    w, x, y, z = state[:, 3:7].T
    return np.column_stack([2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)])


def told(flown: Flown, sensors: Sensors, own: VelocityFilter, rng: np.random.Generator) -> Told:
    """Contents of a dive's messages. The reported attitude and depth are the readings that the autopilot flew by."""
    ticks, noise = flown.ticks, flown.noise
    nu = ticks.state[:, 7:13]
    attitude = np.column_stack([euler(ticks.state), nu[:, 3:]]) + noise[:, :6]
    force = ticks.nu_dot[:, :3] + np.cross(nu[:, 3:], nu[:, :3]) - GRAVITY_M_S2 * down(ticks.state)
    gyro = nu[:, 3:] + noise[:, 3:6]
    velocity = estimated(ticks.moving, STEP_S, EACH * SLOW, own, rng)
    height = ticks.state[::SLOW, 2] + sensors.height * rng.standard_normal(len(velocity))
    position = np.column_stack([reckoned(velocity, TICK_S * SLOW)[:, :2], height])
    supply = ticks.supply[::SECOND].copy()
    supply[:, 0] += sensors.volts * rng.standard_normal(len(supply))
    force = force + sensors.force * rng.standard_normal(force.shape)
    return Told(
        attitude,
        ticks.pwm,
        force,
        gyro,
        position,
        velocity,
        ticks.state[::SLOW, 2] + noise[::SLOW, 6],
        supply,
    )


def tlog_of(heard: Told, lost: float, rng: np.random.Generator) -> bytes:
    """The recording, with a share `lost` of its frames missing."""
    encoder = Encoder(1, 1)
    records: list[bytes] = []
    for late_us, time_s, message in _messages(heard):
        raw = encoder.encode(message)
        if rng.random() >= lost:
            records.append(_STAMP.pack(UNIX_US + round(1e6 * time_s) + late_us) + raw)
    return b"".join(records)


def packed(data: bytes) -> bytes:
    """Gzip the recording; the same recording gives the same bytes."""
    return gzip.compress(data, 6, mtime=0)


def _messages(heard: Told) -> Iterator[tuple[int, float, object]]:
    for tick in range(len(heard.pwm)):
        time_s = tick * TICK_S
        boot_ms = round(1000 * (BOOT_S + time_s))
        if tick % SECOND == 0:
            yield from ((0, time_s, message) for message in _each_second(heard, tick // SECOND, boot_ms))
        yield from ((DELAY_US["fast"], time_s, message) for message in _fast(heard, tick, boot_ms))
        if tick % SLOW == 0:
            yield from (
                (DELAY_US["slow"], time_s, message) for message in _slow(heard, tick // SLOW, boot_ms)
            )


def _each_second(heard: Told, row: int, boot_ms: int) -> Iterator[object]:
    armed = dialect.MAV_MODE_FLAG_SAFETY_ARMED | dialect.MAV_MODE_FLAG_CUSTOM_MODE_ENABLED
    yield dialect.MAVLink_heartbeat_message(
        dialect.MAV_TYPE_SUBMARINE, dialect.MAV_AUTOPILOT_ARDUPILOTMEGA, armed, MODE_ALT_HOLD,
        dialect.MAV_STATE_ACTIVE, 3,
    )  # fmt: skip
    yield dialect.MAVLink_system_time_message(UNIX_US + 1_000_000 * row, boot_ms)
    volts, amps = heard.supply[row]
    cells = [round(1000 * volts), *[65535] * 9]
    yield dialect.MAVLink_battery_status_message(0, 0, 0, 32767, cells, round(100 * amps), -1, -1, -1)


def _fast(heard: Told, row: int, boot_ms: int) -> Iterator[object]:
    yield dialect.MAVLink_attitude_message(boot_ms, *heard.attitude[row].tolist())
    pulses = [round(pulse) for pulse in heard.pwm[row].tolist()]
    yield dialect.MAVLink_servo_output_raw_message(1000 * boot_ms, 0, *(pulses + [0] * 16)[:16])
    force = [round(1000 * value / GRAVITY_M_S2) for value in heard.force[row].tolist()]
    gyro = [round(1000 * value) for value in heard.gyro[row].tolist()]
    yield dialect.MAVLink_scaled_imu2_message(boot_ms, *force, *gyro, 0, 0, 0)


def _slow(heard: Told, row: int, boot_ms: int) -> Iterator[object]:
    yield dialect.MAVLink_local_position_ned_message(
        boot_ms, *heard.position[row].tolist(), *heard.velocity[row].tolist()
    )
    water = Water()
    pascal = water.density_kg_m3 * water.gravity_m_s2 * float(heard.depth[row])
    yield dialect.MAVLink_scaled_pressure2_message(
        boot_ms, water.surface_pressure_hpa + pascal / 100.0, 0.0, 1850
    )
