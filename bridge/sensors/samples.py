"""Sample types of the sensors, in SI units. Times are boot time in seconds, of validity if the device reports it.

A parser gives samples in the device's own axes; `bridge.sensors.mounting` turns them into the body's (FRD: x forward,
y right, z down).
"""

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from bridge.arrays import Array, Quaternion, Vector3


@dataclass(frozen=True, slots=True)
class ImuSample:
    """Specific force (m/s2), rate of turn (rad/s) and, if reported, attitude (w x y z) of one instant."""

    time_s: float
    specific_force: Vector3
    rate: Vector3
    attitude: Quaternion | None = None
    temperature_c: float | None = None


@dataclass(frozen=True, slots=True)
class FogBlock:
    """A series of rates about the gyro's own axis: `time_s` (n,) s, `rate` (n,) rad/s, `valid` (n,) bool."""

    time_s: Array
    rate: Array
    valid: NDArray[np.bool_]


@dataclass(frozen=True, slots=True)
class DvlSample:
    """Velocity over the bottom (m/s) at the transducer; NaN without bottom lock.

    `sigma` is the device's own figure of merit (m/s), NaN if it reports none; `altitude_m` is vertical, NaN if
    unknown.
    """

    time_s: float
    velocity: Vector3
    sigma: float
    altitude_m: float

    @property
    def locked(self) -> bool:
        return not any(v != v for v in self.velocity)


@dataclass(frozen=True, slots=True)
class PressureSample:
    """Absolute pressure (Pa) and water temperature (deg C)."""

    time_s: float
    pressure_pa: float
    temperature_c: float


@dataclass(frozen=True, slots=True)
class EscSample:
    """Telemetry of a speed controller; `rpm` is mechanical and has no sign on the wire."""

    time_s: float
    index: int
    rpm: float
    voltage_v: float
    current_a: float


@dataclass(frozen=True, slots=True)
class GnssSample:
    """A surface fix: degrees, metres, m/s, course in radians; `fix_type` as in MAVLink's GPS_FIX_TYPE."""

    time_s: float
    fix_type: int
    latitude_deg: float
    longitude_deg: float
    altitude_m: float
    horizontal_sigma_m: float
    speed_m_s: float
    course_rad: float
    satellites: int


Sample = ImuSample | FogBlock | DvlSample | PressureSample | EscSample | GnssSample


@dataclass(frozen=True, slots=True)
class Arrival:
    """What the device in a slot of the vehicle file delivered at `time_s`.

    Bytes, the last of which arrived then; a sample, if the device is polled; or a fault ("" once it works again).
    """

    slot: str
    time_s: float
    data: bytes = b""
    sample: PressureSample | None = None
    fault: str | None = None


class Parser(Protocol):
    """Incremental parser of a device's byte stream."""

    def feed(self, data: bytes, time_s: float) -> list[Sample]:
        """Return the samples completed by `data`, whose last byte arrived at boot time `time_s`."""
        ...
