"""A vehicle's pose by dead reckoning: where a flight has come to from where it began, without a position sensor."""

import math
from dataclasses import dataclass
from typing import Final

from bridge.attitude import down_in_body
from bridge.flight.limits import MOST
from bridge.vehicle.navigation import Navigation

FASTEST_M_S: Final = MOST["speed_m_s"]
"""No flight is this fast: a DVL's reading that is counts for up to a second, and would lead the way back astray by as
many metres."""


@dataclass(frozen=True, slots=True)
class Pose:
    """Metres north and east of where the flight began, depth (m) and heading (rad, unwrapped)."""

    north_m: float
    east_m: float
    depth_m: float
    heading_rad: float

    def distance_m(self, other: "Pose") -> float:
        """Horizontal distance."""
        return math.hypot(other.north_m - self.north_m, other.east_m - self.east_m)


def dead_reckoned(pose: Pose, navigation: Navigation, dt_s: float) -> Pose:
    """The pose `dt_s` later: the measured velocity integrated over north and east, the measured depth and heading.

    A value that is not measured (NaN) stays as it was, and the place where the velocity is beyond `FASTEST_M_S`.
    """
    u, v, w = navigation.velocity
    qw, qx, qy, qz = navigation.attitude
    # The first two rows of `body_to_earth`, written out: no arrays in the control loop.
    north = (1 - 2 * (qy * qy + qz * qz)) * u + 2 * (qx * qy - qw * qz) * v + 2 * (qx * qz + qw * qy) * w
    east = 2 * (qx * qy + qw * qz) * u + (1 - 2 * (qx * qx + qz * qz)) * v + 2 * (qy * qz - qw * qx) * w
    # Not true of NaN either.
    if not math.hypot(u, v, w) <= FASTEST_M_S or not (math.isfinite(north) and math.isfinite(east)):
        north = east = 0.0
    depth_m, heading_rad = navigation.depth_m, navigation.heading_rad
    return Pose(
        pose.north_m + north * dt_s,
        pose.east_m + east * dt_s,
        depth_m if math.isfinite(depth_m) else pose.depth_m,
        heading_rad if math.isfinite(heading_rad) else pose.heading_rad,
    )


def tilt_rad(navigation: Navigation) -> float:
    """Angle between the vehicle's downward axis and the vertical; NaN without an attitude."""
    _, _, down = down_in_body(navigation.attitude)
    return math.acos(min(max(down, -1.0), 1.0)) if math.isfinite(down) else math.nan
