"""Thrust as the shaft speeds tell it: the other side of `bridge.vehicle.thrusters.shaft_speed`."""

import numpy as np
from numpy.typing import NDArray

from bridge.effects.course import Course
from bridge.vehicle.config import ThrustCurve

Array = NDArray[np.float64]


def thrust_by_shaft(curve: ThrustCurve, rpm: Array) -> Array:
    """T = k n |n| of signed shaft speeds (n, k), with n in rev/s and k by direction; NaN where nothing tells."""
    speed = rpm / 60.0
    return np.asarray(np.where(rpm >= 0, curve.forward_n_s2, curve.reverse_n_s2) * speed * np.abs(speed))


def seen_by_shaft(course: Course, curve: ThrustCurve) -> Array:
    """(n, k): by how much the thrusts that shaft speeds tell exceed the nominal ones, N: what `Act.shaft_n` adds up
    to, with no water in between. NaN where nothing tells."""
    return np.asarray(thrust_by_shaft(curve, course.rpm) - course.thrust_n)
