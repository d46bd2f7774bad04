"""Thrust computed from shaft speeds: the inverse of `bridge.vehicle.thrusters.shaft_speed`."""

import numpy as np
from numpy.typing import NDArray

from bridge.vehicle.config import ThrustCurve
from identify.effects.course import Course

Array = NDArray[np.float64]


def thrust_by_shaft(curve: ThrustCurve, rpm: Array) -> Array:
    """T = k n |n| for signed shaft speeds (n, k), with n in rev/s and k by direction; NaN if unknown."""
    speed = rpm / 60.0
    return np.asarray(np.where(rpm >= 0, curve.forward_n_s2, curve.reverse_n_s2) * speed * np.abs(speed))


def seen_by_shaft(course: Course, curve: ThrustCurve) -> Array:
    """Excess of the thrusts from shaft speeds over the nominal thrusts, N, (n, k): the sum of all `Act.shaft_n` in
    still water. NaN if unknown."""
    return np.asarray(thrust_by_shaft(curve, course.rpm) - course.thrust_n)
