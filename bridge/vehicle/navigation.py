"""Navigation state for the controller: depth, attitude and motion, from the latest sample of each sensor."""

import math
from dataclasses import dataclass, replace

from bridge.arrays import NAN3, Quaternion, Vector3
from bridge.attitude import heading_of, unwrapped
from bridge.sensors.samples import DvlSample, ImuSample, PressureSample
from bridge.vehicle.config import Vehicle

FOG_STALE_S = 0.5
OLDEST_S = 1.0  # ten readings of a DVL at 10 Hz: beyond that it is no mere dropout


@dataclass(frozen=True, slots=True)
class Navigation:
    """Latest values (SI, FRD) with their times of validity; NaN until the first sample.

    `velocity` is that of the body's origin, held through dropouts. The yaw component of `rate` comes from the
    fibre-optic gyro if there is one. `heading_rad` is unwrapped. `voltage_v` is the recent battery voltage, NaN if
    unknown, as last reported at `voltage_time_s`; `altitude_m` the height over the bottom.
    """

    velocity: Vector3 = NAN3
    velocity_time_s: float = math.nan
    rate: Vector3 = NAN3
    rate_time_s: float = math.nan
    attitude: Quaternion = (math.nan, math.nan, math.nan, math.nan)
    heading_rad: float = math.nan
    attitude_time_s: float = math.nan
    depth_m: float = math.nan
    depth_time_s: float = math.nan
    voltage_v: float = math.nan
    altitude_m: float = math.nan
    altitude_time_s: float = math.nan
    voltage_time_s: float = math.nan


def known_at(navigation: Navigation, now_s: float) -> Navigation:
    """Return the values that may still be acted upon.

    Values older than `OLDEST_S` become NaN, so that nothing steers by a dead sensor; so do those that are stamped as
    far in the future, which would never grow old.
    """
    nan = math.nan
    known = navigation
    if not abs(now_s - navigation.velocity_time_s) <= OLDEST_S:
        known = replace(known, velocity=NAN3)
    if not abs(now_s - navigation.rate_time_s) <= OLDEST_S:
        known = replace(known, rate=NAN3)
    if not abs(now_s - navigation.attitude_time_s) <= OLDEST_S:
        known = replace(known, attitude=(nan, nan, nan, nan), heading_rad=nan)
    if not abs(now_s - navigation.depth_time_s) <= OLDEST_S:
        known = replace(known, depth_m=nan)
    if (
        navigation.altitude_m == navigation.altitude_m
        and not abs(now_s - navigation.altitude_time_s) <= OLDEST_S
    ):
        known = replace(known, altitude_m=nan)
    return known


class Navigator:
    """Keeps the latest values of all sensors; takes samples in body axes."""

    def __init__(self, vehicle: Vehicle) -> None:
        self._water = vehicle.water
        dvl = vehicle.sensors.dvl
        self._dvl_arm = dvl.mounting.position_m if dvl is not None else (0.0, 0.0, 0.0)
        self._known = Navigation()
        """With the rates of the IMU alone."""
        self._yaw_rate, self._yaw_rate_time_s = math.nan, -math.inf

    @property
    def navigation(self) -> Navigation:
        """Latest values of all sensors, without the battery voltage."""
        return replace(self._known, rate=self._best_rate())

    def take_imu(self, sample: ImuSample) -> None:
        """Take the rates and, if the device provides it, the attitude."""
        self._known = replace(self._known, rate=sample.rate, rate_time_s=sample.time_s)
        if sample.attitude is not None:
            heading_rad = unwrapped(heading_of(sample.attitude), self._known.heading_rad)
            self._known = replace(
                self._known,
                attitude=sample.attitude,
                heading_rad=heading_rad,
                attitude_time_s=sample.time_s,
            )

    def take_yaw_rate(self, time_s: float, rate: float) -> None:
        """Take a mean yaw rate (rad/s) of the fibre-optic gyro."""
        self._yaw_rate, self._yaw_rate_time_s = rate, time_s

    def take_dvl(self, sample: DvlSample) -> None:
        """Take a velocity, moved from the transducer to the body's origin. Without bottom lock the last one holds."""
        if sample.altitude_m == sample.altitude_m:
            self._known = replace(self._known, altitude_m=sample.altitude_m, altitude_time_s=sample.time_s)
        if not sample.locked:
            return
        velocity, rate = sample.velocity, self._best_rate()
        if any(self._dvl_arm) and not any(map(math.isnan, rate)):
            velocity = velocity_at_origin(velocity, rate, self._dvl_arm)
        self._known = replace(self._known, velocity=velocity, velocity_time_s=sample.time_s)

    def take_pressure(self, sample: PressureSample) -> None:
        """Compute the depth from an absolute pressure and the vehicle file's surface pressure and water density."""
        depth_m = self._water.depth_m(sample.pressure_pa)
        self._known = replace(self._known, depth_m=depth_m, depth_time_s=sample.time_s)

    def _best_rate(self) -> Vector3:
        rate = self._known.rate
        fresh = not self._known.rate_time_s > self._yaw_rate_time_s + FOG_STALE_S
        if fresh and self._yaw_rate == self._yaw_rate:
            return rate[0], rate[1], self._yaw_rate
        return rate


def velocity_at_origin(velocity: Vector3, rate: Vector3, arm_m: Vector3) -> Vector3:
    """Velocity of the body's origin from that of the point at `arm_m`, body axes."""
    (u, v, w), (p, q, r), (x, y, z) = velocity, rate, arm_m
    return u - (q * z - r * y), v - (r * x - p * z), w - (p * y - q * x)
