"""Body and earth axes of other simulators: FRD to FLU, NED to ENU, and the angles of a direction.

A turn by 180 degrees about x takes FRD to FLU: y and z change sign, and so do the moments and rates about them. A
diagonal matrix of masses or dampings stays as it is.
"""

import math

from bridge.vehicle.config import Vector3


def flu(frd: Vector3) -> Vector3:
    """A vector in forward, left, up from one in forward, right, down."""
    x, y, z = frd
    return x + 0.0, 0.0 - y, 0.0 - z


def enu(ned: Vector3) -> Vector3:
    """A vector in east, north, up from one in north, east, down."""
    north, east, down = ned
    return east + 0.0, north + 0.0, 0.0 - down


def pointing(direction: Vector3) -> Vector3:
    """Roll, pitch and yaw (rad; Rz(yaw) Ry(pitch) Rx(roll)) that turn the x axis to `direction`, of any length."""
    x, y, z = direction
    return 0.0, math.atan2(0.0 - z, math.hypot(x, y)), math.atan2(y, x)
