"""The sensors' table: what each is called, how often it should speak, how it says nothing; and the rows made of it.

Names and least rates are the telemetry contract's, as the doctor knows it. ArduPilot vehicles are asked for less.
"""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Final

from bridge.vehicle.config import Vehicle
from gcs_plugin.doctor.checks import CONTRACT, RATE_TOLERANCE
from gcs_plugin.watch.channels import Channel
from gcs_plugin.watch.freshness import STALE_PERIODS, freshness, period_s
from gcs_plugin.watch.hearing import Values
from gcs_plugin.watch.picture import Condition, Freshness, SensorRow

ARDUPILOT_HZ: Final = 2.0
"""What ground stations ask an ArduPilot vehicle for at the least."""

COMPANION: Final = 191  # the bridge beside an autopilot keeps to the contract
LEAST_NORM, MOST_NORM = 0.9, 1.1  # of an attitude
LEAST_PRESSURE_PA: Final = 30_000.0  # below any lake's
LEAST_VOLTAGE: Final = 0.85
"""Of the voltage that the thrust curve was measured at; thrust is then a quarter less."""

WELL_LOCKED: Final = 0.9
FIRST_LOOK_S: Final = 5.0


def _numbers(values: Values) -> bool:
    return all(map(math.isfinite, values))


def _imu(values: Values) -> bool:
    return _numbers(values[:6]) and any(values[:3])


def _velocity(values: Values) -> bool:
    return _numbers(values[:3])


def _first(values: Values) -> bool:
    return bool(values) and math.isfinite(values[0])


def is_pressure(values: Values) -> bool:
    """Whether there is air or water around."""
    return values[0] > LEAST_PRESSURE_PA


def _attitude(values: Values) -> bool:
    w, x, y, z = values[:4]
    return LEAST_NORM < w * w + x * x + y * y + z * z < MOST_NORM


def _pulses(values: Values) -> bool:
    return bool(values) and _numbers(values)


def _volts(values: Values) -> bool:
    return values[0] > 0.0


def always(values: Values) -> bool:
    """For signals that can't say nothing."""
    del values
    return True


@dataclass(frozen=True, slots=True)
class Sensor:
    """One row of the table; `silent` is said of readings of which `says` holds that they say nothing."""

    signal: str
    says: Callable[[Values], bool]
    silent: str


SENSORS: Final = (
    Sensor("imu", _imu, "no number, or all zero"),
    Sensor("fog", _numbers, "no rate"),
    Sensor("dvl", _velocity, "no bottom lock"),
    Sensor("altitude", _first, "sees no bottom"),
    Sensor("pressure", is_pressure, "no pressure"),
    Sensor("attitude", _attitude, "no attitude"),
    Sensor("pwm", _pulses, "no commands"),
    Sensor("rpm", always, ""),
    Sensor("battery", _volts, "no voltage"),
    Sensor("gnss", always, ""),
)
_EXPECTED: Final = {expected.signal: expected for expected in CONTRACT}


def expected_hz(signal: str, vehicle: Vehicle | None, component: int, of_ardupilot: bool) -> float:
    """How often a signal should come at the least, told by this component."""
    row = _EXPECTED[signal]
    device = None if vehicle is None else vehicle.sensors.present().get(row.device)
    hz = row.least_hz if device is None or not device.rate_hz else min(row.least_hz, device.rate_hz)
    return min(hz, ARDUPILOT_HZ) if of_ardupilot and component != COMPANION else hz


def is_expected(signal: str, vehicle: Vehicle | None) -> bool:
    """Whether the vehicle file names what tells this signal."""
    return vehicle is not None and _EXPECTED[signal].device in vehicle.sensors.present()


def sensor_rows(
    channels: Mapping[str, Channel],
    vehicle: Vehicle | None,
    now_s: float,
    hz_of: Callable[[str], float],
    locked_share: float,
) -> tuple[SensorRow, ...]:
    """A row for each sensor that the vehicle file names or that was heard, in the order of the table.

    `hz_of` says how often a signal should come, as `expected_hz`. `locked_share`: of the DVL's pings in the last
    minute, NaN for none.
    """
    rows = []
    for sensor in SENSORS:
        channel = channels[sensor.signal]
        if channel.first_s == math.inf and not is_expected(sensor.signal, vehicle):
            continue
        hz = hz_of(sensor.signal)
        age_s = channel.age_s(now_s)
        fresh = freshness(age_s, hz)
        rate_hz = channel.rate_hz(now_s, STALE_PERIODS * period_s(hz))
        condition, words = _judged(sensor, channel, fresh, now_s)
        if condition is Condition.OK:
            condition, words = _weak(sensor.signal, channel, vehicle, now_s, rate_hz, hz, locked_share)
        rows.append(
            SensorRow(
                _EXPECTED[sensor.signal].label, sensor.signal, rate_hz, hz, age_s, fresh, condition, words
            )
        )
    return tuple(rows)


def _judged(sensor: Sensor, channel: Channel, fresh: Freshness, now_s: float) -> tuple[Condition, str]:
    if channel.first_s == math.inf:
        return Condition.MISSING, "never heard; check the device and its port"
    age_s = channel.age_s(now_s)
    if fresh is Freshness.GONE:
        return Condition.MISSING, f"silent for {age_s:.1f} s"
    if channel.said_s < channel.heard_s:
        return Condition.BAD, f"{sensor.silent} for {channel.mute_s(now_s):.1f} s"
    if fresh is Freshness.STALE:
        return Condition.DEGRADED, f"silent for {age_s:.1f} s"
    return Condition.OK, ""


def _weak(
    signal: str,
    channel: Channel,
    vehicle: Vehicle | None,
    now_s: float,
    rate_hz: float,
    hz: float,
    locked_share: float,
) -> tuple[Condition, str]:
    """What is less than it should be of a sensor that speaks."""
    if signal == "gnss":
        fixed = channel.values[0] >= 2
        return Condition.OK, "" if fixed else "no fix"
    if signal == "dvl" and locked_share < WELL_LOCKED:
        return Condition.DEGRADED, f"bottom lock in {locked_share:.0%} of the last minute"
    if signal == "battery" and vehicle is not None and vehicle.thrust_curve.kind == "table":
        nominal_v = vehicle.thrust_curve.voltage_v
        if channel.values[0] < LEAST_VOLTAGE * nominal_v:
            return (
                Condition.DEGRADED,
                f"{channel.values[0]:.1f} V, and the thrust curve is of {nominal_v:g} V",
            )
    if now_s - channel.first_s > FIRST_LOOK_S and rate_hz < RATE_TOLERANCE * hz:
        return Condition.DEGRADED, f"slow: {rate_hz:.1f} of {hz:g} Hz"
    return Condition.OK, ""
