"""A vehicle's place by dead reckoning, and the course that leads it to a place and keeps it there. Pure."""

import math
from dataclasses import dataclass
from typing import Final

from bridge.attitude import down_in_body
from bridge.vehicle.navigation import Navigation
from bridge.vehicle.references import Reference, shorter_turn

GAIN_PER_S: Final = 0.25
"""Wanted speed over distance, near the place: a quarter of the way in a second."""
ACCELERATION_M_S2: Final = 0.08
HEAVE_M_S: Final = 0.1
TURN_RAD_S: Final = math.radians(12.0)
NEAR_M: Final = 0.25
NEAR_ABOUT_M: Final = 0.6
"""The same for a vehicle that can't move sideways: it turns towards the place, and this near turns no more."""
NEAR_DEPTH_M: Final = 0.15
NEAR_RAD: Final = math.radians(6.0)
SLOW_M_S: Final = 0.06


@dataclass(frozen=True, slots=True)
class Pose:
    """North and east of where the flight began, depth (m) and heading (rad, unwrapped)."""

    north_m: float
    east_m: float
    depth_m: float
    heading_rad: float

    def distance_m(self, other: "Pose") -> float:
        """Horizontal distance."""
        return math.hypot(other.north_m - self.north_m, other.east_m - self.east_m)


def moved(pose: Pose, navigation: Navigation, dt_s: float) -> Pose:
    """The pose after `dt_s` at the navigation's velocity, with its depth and heading where it has them."""
    u, v, w = navigation.velocity
    a, b, c, d = navigation.attitude
    north = (1 - 2 * (c * c + d * d)) * u + 2 * (b * c - a * d) * v + 2 * (b * d + a * c) * w
    east = 2 * (b * c + a * d) * u + (1 - 2 * (b * b + d * d)) * v + 2 * (c * d - a * b) * w
    if not (math.isfinite(north) and math.isfinite(east)):
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


class Course:
    """Leads a vehicle to `target` at up to `speed_m_s` and keeps it there; its wanted speed changes without a jump."""

    def __init__(self, here: Pose, target: Pose, speed_m_s: float, *, sways: bool) -> None:
        self.target = target
        self._speed_m_s, self._sways = speed_m_s, sways
        self._depth_m, self._heading_rad = here.depth_m, here.heading_rad
        self._ahead = self._aside = 0.0

    def step(self, here: Pose, dt_s: float) -> Reference:
        north, east = self.target.north_m - here.north_m, self.target.east_m - here.east_m
        away_m = math.hypot(north, east)
        speed = min(GAIN_PER_S * away_m, self._speed_m_s)
        bearing = math.atan2(east, north) - here.heading_rad
        ahead, aside = speed * math.cos(bearing), speed * math.sin(bearing)
        heading = self.target.heading_rad
        if not self._sways:
            far = away_m > NEAR_ABOUT_M
            heading = here.heading_rad + math.remainder(bearing, math.tau) if far else heading
            ahead, aside = max(ahead, 0.0) if far else 0.0, 0.0
        most = ACCELERATION_M_S2 * dt_s
        du, dv = _within(ahead - self._ahead, most), _within(aside - self._aside, most)
        dz = _within(self.target.depth_m - self._depth_m, HEAVE_M_S * dt_s)
        dpsi = _within(shorter_turn(self._heading_rad, heading), TURN_RAD_S * dt_s)
        self._ahead, self._aside = self._ahead + du, self._aside + dv
        self._depth_m, self._heading_rad = self._depth_m + dz, self._heading_rad + dpsi
        nu = (self._ahead, self._aside, dz / dt_s, 0.0, 0.0, dpsi / dt_s)
        return Reference(nu, (du / dt_s, dv / dt_s, 0.0, 0.0, 0.0, 0.0), self._heading_rad, self._depth_m)

    def arrived(self, here: Pose, speed_m_s: float) -> bool:
        """Whether the vehicle is at its place, at rest."""
        return (
            here.distance_m(self.target) <= (NEAR_M if self._sways else 1.5 * NEAR_ABOUT_M)
            and abs(here.depth_m - self.target.depth_m) <= NEAR_DEPTH_M
            and abs(shorter_turn(here.heading_rad, self.target.heading_rad)) <= NEAR_RAD
            and speed_m_s <= SLOW_M_S
        )


def _within(value: float, most: float) -> float:
    return min(max(value, -most), most)
