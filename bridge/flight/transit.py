"""The references that bring a vehicle to a pose and keep it there. Pure: no clock, no link."""

import math
from typing import Final

from bridge.flight.pose import Pose
from bridge.vehicle.references import Reference, shorter_turn

GAIN_PER_S: Final = 0.25
"""Speed asked for over the distance left: near the target the vehicle closes a quarter of it each second."""
ACCELERATION_M_S2: Final = 0.08
HEAVE_M_S: Final = 0.1
TURN_RAD_S: Final = math.radians(12.0)
ARRIVED_M: Final = 0.25
STOPS_TURNING_M: Final = 0.6
"""A vehicle without sway points its bow at the target. From this distance on it takes the target's heading instead,
since the bearing swings wildly there."""
ARRIVED_WITHOUT_SWAY_M: Final = 1.5 * STOPS_TURNING_M
ARRIVED_DEPTH_M: Final = 0.15
ARRIVED_HEADING_RAD: Final = math.radians(6.0)
AT_REST_M_S: Final = 0.06


class Transit:
    """Guides a vehicle to `target` at up to `speed_m_s`, then keeps it there; the speed asked for never jumps.

    `sways`: whether the thrusters can push the vehicle sideways. If not, it turns its bow to the target and drives.
    """

    def __init__(self, here: Pose, target: Pose, speed_m_s: float, *, sways: bool) -> None:
        self.target = target
        self._speed_m_s, self._sways = speed_m_s, sways
        self._depth_m, self._heading_rad = here.depth_m, here.heading_rad
        self._surge_m_s = self._sway_m_s = 0.0

    def step(self, here: Pose, dt_s: float) -> Reference:
        """The reference of the next tick, `dt_s` after the last, for a vehicle at `here`."""
        north, east = self.target.north_m - here.north_m, self.target.east_m - here.east_m
        away_m = math.hypot(north, east)
        speed = min(GAIN_PER_S * away_m, self._speed_m_s)
        bearing = math.atan2(east, north) - here.heading_rad
        surge, sway = speed * math.cos(bearing), speed * math.sin(bearing)
        heading = self.target.heading_rad
        if not self._sways:
            far = away_m > STOPS_TURNING_M
            heading = here.heading_rad + math.remainder(bearing, math.tau) if far else heading
            surge, sway = max(surge, 0.0) if far else 0.0, 0.0
        most = ACCELERATION_M_S2 * dt_s
        du, dv = _within(surge - self._surge_m_s, most), _within(sway - self._sway_m_s, most)
        dz = _within(self.target.depth_m - self._depth_m, HEAVE_M_S * dt_s)
        dpsi = _within(shorter_turn(self._heading_rad, heading), TURN_RAD_S * dt_s)
        self._surge_m_s, self._sway_m_s = self._surge_m_s + du, self._sway_m_s + dv
        self._depth_m, self._heading_rad = self._depth_m + dz, self._heading_rad + dpsi
        nu = (self._surge_m_s, self._sway_m_s, dz / dt_s, 0.0, 0.0, dpsi / dt_s)
        return Reference(nu, (du / dt_s, dv / dt_s, 0.0, 0.0, 0.0, 0.0), self._heading_rad, self._depth_m)

    def arrived(self, here: Pose, speed_m_s: float) -> bool:
        """Whether the vehicle is at the target, at rest."""
        return (
            here.distance_m(self.target) <= (ARRIVED_M if self._sways else ARRIVED_WITHOUT_SWAY_M)
            and abs(here.depth_m - self.target.depth_m) <= ARRIVED_DEPTH_M
            and abs(shorter_turn(here.heading_rad, self.target.heading_rad)) <= ARRIVED_HEADING_RAD
            and speed_m_s <= AT_REST_M_S
        )


def _within(value: float, most: float) -> float:
    return min(max(value, -most), most)
