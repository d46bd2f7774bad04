"""The body's motion at chosen moments, and at points away from its origin."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bridge.simulator.plant import Stretch

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Motion:
    """NED position, attitude w x y z, body velocity and rate and their derivatives, with a row per moment."""

    time_s: Array
    position: Array
    attitude: Array
    velocity: Array
    rate: Array
    acceleration: Array
    turning: Array

    def earth_velocity(self) -> Array:
        """Velocity of the origin, north and east, shape (k, 2)."""
        w, x, y, z = self.attitude.T
        u, v, down = self.velocity.T
        north = (1 - 2 * (y * y + z * z)) * u + 2 * (x * y - w * z) * v + 2 * (x * z + w * y) * down
        east = 2 * (x * y + w * z) * u + (1 - 2 * (x * x + z * z)) * v + 2 * (y * z - w * x) * down
        return np.stack([north, east], axis=1)

    def velocity_at(self, arm_m: Array) -> Array:
        """Body velocity of the point at `arm_m`, shape (k, 3)."""
        return self.velocity + _cross(self.rate, arm_m)

    def depth_of(self, arm_m: Array) -> Array:
        """Depth of the point at `arm_m`, shape (k,)."""
        return self.position[:, 2] + self._down() @ arm_m

    def specific_force_at(self, arm_m: Array, gravity_m_s2: float) -> Array:
        """Specific force on an accelerometer at `arm_m`, body axes, shape (k, 3)."""
        inner = _cross(self.turning, arm_m) + _cross(self.rate, _cross(self.rate, arm_m))
        return self.acceleration + _cross(self.rate, self.velocity) + inner - gravity_m_s2 * self._down()

    def _down(self) -> Array:
        """The downward vertical in body axes, shape (k, 3)."""
        w, x, y, z = self.attitude.T
        return np.stack([2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)], axis=1)


def motion_at(stretch: Stretch, time_s: Array) -> Motion:
    """The body's motion at moments within the stretch, interpolated linearly between physics steps."""
    step = stretch.time_s[1] - stretch.time_s[0]
    place = np.clip((time_s - stretch.time_s[0]) / step, 0, len(stretch.time_s) - 1)
    left = np.minimum(place.astype(int), len(stretch.time_s) - 2)
    share = (place - left)[:, None]
    state = (1 - share) * stretch.state[left] + share * stretch.state[left + 1]
    nu_dot = (1 - share) * stretch.nu_dot[left] + share * stretch.nu_dot[left + 1]
    return Motion(
        time_s, state[:, :3], state[:, 3:7], state[:, 7:10], state[:, 10:13], nu_dot[:, :3], nu_dot[:, 3:]
    )


def moments(stretch: Stretch, rate_hz: float) -> Array:
    """The multiples of the period after the start of the stretch, up to its end."""
    first = math.floor(stretch.time_s[0] * rate_hz + 1e-6) + 1
    last = math.floor(stretch.time_s[-1] * rate_hz + 1e-6)
    return np.arange(first, last + 1) / rate_hz


def _cross(a: Array, b: Array) -> Array:
    """Vector products along the last axis; `np.cross` takes four times as long for a handful of rows."""
    ax, ay, az = a[..., 0], a[..., 1], a[..., 2]
    bx, by, bz = b[..., 0], b[..., 1], b[..., 2]
    return np.stack([ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx], axis=-1)
