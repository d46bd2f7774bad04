"""Converts thrusts to pulse widths, with the dead zone kept for small thrusts."""

import numpy as np
from numpy.typing import ArrayLike, NDArray

from bridge.vehicle.thrusters import NEUTRAL_US, Curve

Array = NDArray[np.float64]


class Pulses:
    """The inverse of the curve, but a straight line to neutral below `straight_below_n` (N, a scalar or one per
    thruster).

    On the straight line a small thrust is lost in the dead zone; jumping over the dead zone instead, noise about zero
    would throw the propellers to and fro.
    """

    def __init__(self, curve: Curve, straight_below_n: ArrayLike) -> None:
        self._curve = curve
        self._below_n: Array = np.asarray(straight_below_n, dtype=float)
        width_n = np.where(self._below_n > 0, self._below_n, 1.0)
        self._ahead: Array = (curve.pwm(width_n) - NEUTRAL_US) / width_n
        self._astern: Array = (NEUTRAL_US - curve.pwm(-width_n)) / width_n

    def __call__(self, thrust_n: Array) -> Array:
        """Pulse widths (n,) in microseconds for thrusts (n,) in N."""
        straight = NEUTRAL_US + thrust_n * np.where(thrust_n > 0, self._ahead, self._astern)
        return np.where(np.abs(thrust_n) < self._below_n, straight, self._curve.pwm(thrust_n))
