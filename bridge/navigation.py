"""Where the vehicle is and how it moves, as the controller sees it: the latest of every sensor."""

import math
from dataclasses import dataclass

from bridge.sensors.samples import NAN3, Quaternion, Vector3


@dataclass(frozen=True, slots=True)
class Navigation:
    """The latest values (SI, FRD) with their times of validity; NaN until first heard.

    `velocity` is held through dropouts. `rate` takes yaw from the fibre-optic gyro where there is one.
    `heading_rad` is unwrapped.
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
