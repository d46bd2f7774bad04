"""The table of sensors: names, least rates, tests for valid readings; and the rows made from it.

Names and least rates are those of the telemetry contract in the doctor. A vehicle with an autopilot needs only lower
rates.
"""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Final

from bridge.firmware.description import Firmware
from bridge.vehicle.config import Vehicle
from bridge.wire.readings import Values
from gcs_plugin.doctor.checks import CONTRACT, RATE_TOLERANCE, least_hz
from gcs_plugin.watch.channels import Channel
from gcs_plugin.watch.picture import STALE_PERIODS, Condition, Freshness, SensorRow, freshness, period_s

LEAST_NORM, MOST_NORM = 0.9, 1.1  # squared norm of an attitude quaternion
LEAST_PRESSURE_PA: Final = 30_000.0  # less than the air pressure at any lake
LEAST_VOLTAGE: Final = 0.85
"""Share of the voltage at which the thrust curve was measured; thrust is then a quarter less."""

WELL_LOCKED: Final = 0.9
FIRST_LOOK_S: Final = 5.0


def _numbers(values: Values) -> bool:
    return all(map(math.isfinite, values))


def is_pressure(values: Values) -> bool:
    """Whether the pressure is that of air or water."""
    return values[0] > LEAST_PRESSURE_PA


def always(values: Values) -> bool:
    """For signals whose values are always valid."""
    del values
    return True


@dataclass(frozen=True, slots=True)
class Sensor:
    """A row of the table; `says` tests whether a reading has a value, `silent` describes readings without a value."""

    signal: str
    says: Callable[[Values], bool]
    silent: str


SENSORS: Final = (
    Sensor("imu", lambda values: _numbers(values[:6]) and any(values[:3]), "no number, or all zero"),
    Sensor("fog", _numbers, "no rate"),
    Sensor("dvl", lambda values: _numbers(values[:3]), "no bottom lock"),
    Sensor("altitude", lambda values: math.isfinite(values[0]), "sees no bottom"),
    Sensor("pressure", is_pressure, "no pressure"),
    Sensor("attitude", lambda values: LEAST_NORM < sum(v * v for v in values[:4]) < MOST_NORM, "no attitude"),
    Sensor("pwm", lambda values: bool(values) and _numbers(values), "no commands"),
    Sensor("rpm", always, ""),
    Sensor("battery", lambda values: values[0] > 0.0, "no voltage"),
    Sensor("gnss", always, ""),
)
_EXPECTED: Final = {expected.signal: expected for expected in CONTRACT}


def expected_hz(signal: str, vehicle: Vehicle | None, component: int, firmware: Firmware | None) -> float:
    """Least rate of a signal from this component, beside an autopilot with this firmware or none."""
    return least_hz(_EXPECTED[signal], vehicle, component, firmware)


def is_expected(signal: str, vehicle: Vehicle | None) -> bool:
    """Whether the vehicle file names the device of this signal."""
    return vehicle is not None and _EXPECTED[signal].device in vehicle.sensors.present()


def sensor_rows(
    channels: Mapping[str, Channel],
    vehicle: Vehicle | None,
    now_s: float,
    hz_of: Callable[[str], float],
    locked_share: float,
    listened_s: float,
) -> tuple[SensorRow, ...]:
    """A row for each sensor that the vehicle file names or that was heard, in the order of the table.

    `hz_of` returns a signal's least rate, as `expected_hz` does. `locked_share`: share of the DVL's pings in the last
    minute with bottom lock, NaN without pings. `listened_s`: for so long the vehicle has been listened to.
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
        if channel.first_s == math.inf:
            condition, words = _unheard(listened_s, hz)
        else:
            condition, words = _judged(sensor, channel, fresh, now_s)
        if condition is Condition.OK:
            condition, words = _weak(sensor.signal, channel, vehicle, now_s, rate_hz, hz, locked_share)
        rows.append(
            SensorRow(
                _EXPECTED[sensor.signal].label, sensor.signal, rate_hz, hz, age_s, fresh, condition, words
            )
        )
    return tuple(rows)


def _unheard(listened_s: float, hz: float) -> tuple[Condition, str]:
    if listened_s > FIRST_LOOK_S and freshness(listened_s, hz) is Freshness.GONE:
        return Condition.MISSING, "never heard; check the device and its port"
    return Condition.AWAITED, "not heard yet"


def _judged(sensor: Sensor, channel: Channel, fresh: Freshness, now_s: float) -> tuple[Condition, str]:
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
    """Shortcomings of a sensor that sends valid values."""
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
