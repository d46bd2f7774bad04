"""Converts to the body and earth axes of other simulators: FRD to FLU, NED to ENU, and a direction to angles.

A rotation by 180 degrees about x takes FRD to FLU: y and z change sign, and so do the moments and rates about them. A
diagonal matrix of masses or dampings stays the same.
"""

import math

from bridge.vehicle.config import Vector3


def flu(frd: Vector3) -> Vector3:
    """Convert a vector from forward, right, down to forward, left, up."""
    x, y, z = frd
    return x + 0.0, 0.0 - y, 0.0 - z


def enu(ned: Vector3) -> Vector3:
    """Convert a vector from north, east, down to east, north, up."""
    north, east, down = ned
    return east + 0.0, north + 0.0, 0.0 - down


def pointing(direction: Vector3) -> Vector3:
    """Roll, pitch and yaw (rad; Rz(yaw) Ry(pitch) Rx(roll)) that turn the x axis to `direction`, of any length."""
    x, y, z = direction
    return 0.0, math.atan2(0.0 - z, math.hypot(x, y)), math.atan2(y, x)
