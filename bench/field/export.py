"""A flown dive as a stock autopilot's `.tlog`: only ArduSub's messages, in its units and at its rates, frames lost."""

import struct
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from pymavlink.dialects.v20 import ardupilotmega as dialect

from bench.field.autopilot import NEUTRAL, Autopilot, VelocityFilter, estimated, reckoned
from bench.field.dive import EACH, STEP_S
from bench.field.mission import TICK_S
from bench.field.simulate import Flown, Sensors
from bridge.arrays import Array
from bridge.attitude import down_in_body
from bridge.vehicle.config import GRAVITY_M_S2, Water
from bridge.wire.framing import Encoder
from identify.challenge.dive import pulse
from identify.ingest.rotation import euler_angles

UNIX_US = 1_760_000_000_000_000
BOOT_S = 47
"""Boot time at the beginning of the recording, s."""

SLOW, SECOND = 2, 20
"""Ticks between messages of 10 and 1 Hz."""

DELAY_US = {"fast": 4000, "slow": 6000}


@dataclass(frozen=True)
class Rates:
    """Ticks between the messages of a kind; 0 for messages that are not sent."""

    pulses: int = 1
    imu: int = 1
    position: int = SLOW
    pressure: int = SLOW
    sticks: int = 0


COMPANION = Rates()
"""A log from the vehicle's own computer."""

STATION = Rates(pulses=10, imu=10, position=6, pressure=10, sticks=1)
"""A ground station's own log: pulses, accelerometer and pressure twice a second, position 3.3 Hz, and the sticks that
it sends; attitude at 20 Hz."""

FULL_STICK = 1000
MODE_ALT_HOLD = 2
_STAMP = struct.Struct(">Q")


@dataclass(frozen=True)
class MessageContents:
    """Contents of the messages, SI units, a row per message.

    Fast: attitude (n, 6) roll pitch yaw and rates, pwm (n, k), force (n, 3), gyro (n, 3); slow: position (m, 3),
    velocity (m, 3) NED, depth (m,); once a second: supply (s, 2). sticks (n, 4): -FULL_STICK to FULL_STICK, sent.
    """

    attitude: Array
    pwm: Array
    force: Array
    gyro: Array
    position: Array
    velocity: Array
    depth: Array
    supply: Array
    sticks: Array


def down(state: Array) -> Array:
    """The unit vector down (n, 3), in body axes."""
    return np.column_stack(down_in_body(state[:, 3:7].T))


def telemetry_of(
    flown: Flown,
    sensors: Sensors,
    velocity_filter: VelocityFilter,
    autopilot: Autopilot,
    rng: np.random.Generator,
) -> MessageContents:
    """Contents of a dive's messages. The reported attitude and depth are the readings that the autopilot flew by."""
    ticks, noise = flown.ticks, flown.noise
    nu = ticks.state[:, 7:13]
    attitude = np.column_stack([*euler_angles(ticks.state[:, 3:7]), nu[:, 3:]]) + noise[:, :6]
    force = ticks.nu_dot[:, :3] + np.cross(nu[:, 3:], nu[:, :3]) - GRAVITY_M_S2 * down(ticks.state)
    gyro = nu[:, 3:] + noise[:, 3:6]
    velocity = estimated(ticks.moving, STEP_S, EACH * SLOW, velocity_filter, rng)
    height = ticks.state[::SLOW, 2] + sensors.height * rng.standard_normal(len(velocity))
    position = np.column_stack([reckoned(velocity, TICK_S * SLOW)[:, :2], height])
    supply = ticks.supply[::SECOND].copy()
    supply[:, 0] += sensors.volts * rng.standard_normal(len(supply))
    force = force + sensors.force * rng.standard_normal(force.shape)
    return MessageContents(
        attitude,
        ticks.pwm,
        force,
        gyro,
        position,
        velocity,
        ticks.state[::SLOW, 2] + noise[::SLOW, 6],
        supply,
        positions(ticks.asked, autopilot),
    )


def positions(asked: Array, autopilot: Autopilot) -> Array:
    """Positions (n, 4) of the sticks (n, 5): a rate of sinking or turning goes with its stick, and so does what surge
    and sway ask of the mixer, a pulse of the stock one, a force of the other."""
    shares = asked[:, :4].copy()
    if autopilot.straight:
        for axis in (0, 1):
            each_n = asked[:, axis] / autopilot.reach[axis]
            shares[:, axis] = [
                pulse(share, autopilot.thrust_at, NEUTRAL) - NEUTRAL for share in each_n.tolist()
            ]
    return FULL_STICK * shares / np.maximum(np.abs(shares).max(axis=0), 1e-9)


def tlog_of(
    contents: MessageContents, lost: float, rng: np.random.Generator, rates: Rates = COMPANION
) -> bytes:
    """The recording, with a share `lost` of its frames missing."""
    vehicle, station = Encoder(1, 1), Encoder(255, 190)
    records: list[bytes] = []
    for late_us, time_s, message in _messages(contents, rates):
        sent = isinstance(message, dialect.MAVLink_manual_control_message)
        raw = (station if sent else vehicle).encode(message)
        if rng.random() >= lost:
            records.append(_STAMP.pack(UNIX_US + round(1e6 * time_s) + late_us) + raw)
    return b"".join(records)


def _messages(contents: MessageContents, rates: Rates) -> Iterator[tuple[int, float, object]]:
    for tick in range(len(contents.pwm)):
        time_s = tick * TICK_S
        boot_ms = round(1000 * (BOOT_S + time_s))
        if tick % SECOND == 0:
            yield from ((0, time_s, message) for message in _each_second(contents, tick // SECOND, boot_ms))
        for message in _fast(contents, tick, boot_ms, rates):
            yield DELAY_US["fast"], time_s, message
        for message in _slow(contents, tick, boot_ms, rates):
            yield DELAY_US["slow"], time_s, message


def _each_second(contents: MessageContents, row: int, boot_ms: int) -> Iterator[object]:
    armed = dialect.MAV_MODE_FLAG_SAFETY_ARMED | dialect.MAV_MODE_FLAG_CUSTOM_MODE_ENABLED
    yield dialect.MAVLink_heartbeat_message(
        dialect.MAV_TYPE_SUBMARINE, dialect.MAV_AUTOPILOT_ARDUPILOTMEGA, armed, MODE_ALT_HOLD,
        dialect.MAV_STATE_ACTIVE, 3,
    )  # fmt: skip
    yield dialect.MAVLink_system_time_message(UNIX_US + 1_000_000 * row, boot_ms)
    volts, amps = contents.supply[row]
    cells = [round(1000 * volts), *[65535] * 9]
    yield dialect.MAVLink_battery_status_message(0, 0, 0, 32767, cells, round(100 * amps), -1, -1, -1)


def _fast(contents: MessageContents, tick: int, boot_ms: int, rates: Rates) -> Iterator[object]:
    yield dialect.MAVLink_attitude_message(boot_ms, *contents.attitude[tick].tolist())
    if tick % rates.pulses == 0:
        pulses = [round(pulse) for pulse in contents.pwm[tick].tolist()]
        yield dialect.MAVLink_servo_output_raw_message(1000 * boot_ms, 0, *(pulses + [0] * 16)[:16])
    if tick % rates.imu == 0:
        force = [round(1000 * value / GRAVITY_M_S2) for value in contents.force[tick].tolist()]
        gyro = [round(1000 * value) for value in contents.gyro[tick].tolist()]
        yield dialect.MAVLink_scaled_imu2_message(boot_ms, *force, *gyro, 0, 0, 0)
    if rates.sticks and tick % rates.sticks == 0:
        yield dialect.MAVLink_manual_control_message(1, *map(round, contents.sticks[tick].tolist()), 0)


def _slow(contents: MessageContents, tick: int, boot_ms: int, rates: Rates) -> Iterator[object]:
    row = tick // SLOW
    if tick % rates.position == 0:
        yield dialect.MAVLink_local_position_ned_message(
            boot_ms, *contents.position[row].tolist(), *contents.velocity[row].tolist()
        )
    if tick % rates.pressure == 0:
        water = Water()
        pascal = water.density_kg_m3 * water.gravity_m_s2 * float(contents.depth[row])
        yield dialect.MAVLink_scaled_pressure2_message(
            boot_ms, water.surface_pressure_hpa + pascal / 100.0, 0.0, 1850
        )
