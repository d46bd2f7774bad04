"""The motion of a vehicle, instant by instant: everything that an effect can depend on."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numba import njit
from numpy.typing import NDArray

from bridge.arrays import Array
from bridge.vehicle.config import Configuration
from bridge.vehicle.dynamics import coriolis
from bridge.vehicle.thrusters import allocation_matrix


@dataclass(frozen=True)
class Course:
    """A vehicle's motion and its nominal model at uniform instants `time_s` (n,), body frame FRD, SI units.

    - nu, nu_dot (n, 6): velocity of the body's origin through the water as far as the water is known, else over
      ground, and its rate in body axes.
    - euler (n, 3): roll, pitch and unwrapped heading.
    - depth_m, altitude_m, voltage_v (n,): NaN if unknown.
    - position_m (n, 2): north and east of the starting point.
    - asked_n (n, k): thrust asked of each thruster by its nominal curve, the mean over the step after each instant;
      rpm (n, k): signed shaft speeds, NaN if unknown.
    - lag_s: the thrusters' nominal lag.
    - mass, damping (6,): of the nominal model, total; quadratic (6,): drag by the square of the speed, if known.
    - water (n, 3): the water's own velocity, body axes, as far as it is known; None for still water.
    - drift (n, 3): surge, sway and heave estimated from all readings together; None means those of nu. Moments are
      computed from it: no gyro measures it, and a predicted nu carries the errors of the readings.
    - runs_s: first and last time of each run of a dive made of several; empty for a single one.
    - by_wrench: no pulses are known, and asked_n (n, 6) is the wrench itself, as if of a single thruster in each
      degree of freedom.
    - by_shaft: the nominal lag is that of the shafts' speed, not of the thrust.

    Arrays are stored column by column, because most computations use a single column.
    """

    configuration: Configuration
    time_s: Array
    nu: Array
    nu_dot: Array
    euler: Array
    depth_m: Array
    altitude_m: Array
    position_m: Array
    asked_n: Array
    rpm: Array
    voltage_v: Array
    lag_s: float
    mass: Array
    damping: Array
    quadratic: Array = field(default_factory=lambda: np.zeros(6))
    water: Array | None = None
    by_wrench: bool = False
    by_shaft: bool = False
    drift: Array | None = None
    runs_s: tuple[tuple[float, float], ...] = ()

    @cached_property
    def recorded(self) -> NDArray[np.bool_]:
        """Whether each instant (n,) lies in a run: between two, all that is here is made up."""
        return in_a_run(self.time_s, self.runs_s)

    @property
    def step_s(self) -> float:
        return float(self.time_s[1] - self.time_s[0])

    @cached_property
    def since_s(self) -> Array:
        """Time since the start, (n,)."""
        return np.asarray(self.time_s - self.time_s[0])

    @cached_property
    def below_m(self) -> Array:
        """Depth below its median, (n,); 0 if unknown."""
        known = np.isfinite(self.depth_m)
        if not known.any():
            return np.zeros_like(self.depth_m)
        return np.where(known, self.depth_m - np.median(self.depth_m[known]), 0.0)

    @cached_property
    def thrust_n(self) -> Array:
        """Thrust of each thruster by its nominal curve and lag, (n, k)."""
        follow = shaft_lagged if self.by_shaft else thrust_of
        return follow(self.asked_n, self.step_s, self.lag_s)

    @cached_property
    def allocation(self) -> Array:
        """Wrench per newton of each thruster, (6, k)."""
        return np.eye(6) if self.by_wrench else allocation_matrix(self.configuration)

    @cached_property
    def added_mass(self) -> Array:
        """Mass that the water adds to the rigid body in the nominal model, (6,)."""
        rigid = [self.configuration.dry_mass_kg] * 3 + list(self.configuration.inertia_kgm2)
        return np.asarray(self.mass - np.array(rigid))

    @cached_property
    def over_ground(self) -> tuple[Array, Array]:
        """Velocity over ground, and its rate in body axes, (n, 6) each."""
        if self.water is None:
            return self.nu, self.nu_dot
        nu, nu_dot = self.nu.copy(order="F"), self.nu_dot.copy(order="F")
        nu[:, :3] += self.water
        nu_dot[:, :3] += np.gradient(self.water, self.step_s, axis=0)
        return nu, nu_dot

    @property
    def drifting(self) -> Array:
        """Surge, sway and heave for the computation of moments, (n, 3)."""
        return self.nu[:, :3] if self.drift is None else self.drift

    def drag_of(self, nu: Array) -> Array:
        """Drag of the hull at velocities (n, 6) through the water, (n, 6)."""
        return np.asarray((self.damping + self.quadratic * np.abs(nu)) * nu)

    def wrench_of(self, thrust_n: Array) -> Array:
        """Wrench (n, 6) of thrusts (n, k)."""
        return np.asarray((self.allocation @ thrust_n.T).T)

    def turned_by(self, water: Array) -> Array:
        """Excess of Coriolis forces, (n, 6), in a model of the velocity over ground, if the water moves by
        `water` (n, 3). It is proportional to `water`: the squares of the two velocities differ by `water` times
        their mean."""
        m_u, m_v, m_w = self.mass[:3]
        w_u, w_v, w_w = water.T
        known = np.zeros(3) if self.water is None else 0.5 * self.water
        u, v, w = (self.drifting + known).T
        p, q, r = self.nu[:, 3:].T
        out = np.empty((6, len(self.nu)))
        out[0] = m_w * w_w * q - m_v * w_v * r
        out[1] = m_u * w_u * r - m_w * w_w * p
        out[2] = m_v * w_v * p - m_u * w_u * q
        out[3] = (m_w - m_v) * (w_v * w + v * w_w)
        out[4] = (m_u - m_w) * (w_u * w + u * w_w)
        out[5] = (m_v - m_u) * (w_u * v + u * w_v)
        return out.T

    def pushed_by(self, water: Array) -> Array:
        """Wrench (n, 6) missing from a model of the velocity over ground, if the water moves by `water` and the
        course knows of no other water: Coriolis forces, drag and inertia."""
        ground, _ = self.over_ground
        through = ground.copy()
        through[:, :3] -= water
        out = self.turned_by(water) + self.drag_of(ground) - self.drag_of(through)
        out[:, :3] += self.mass[:3] * np.gradient(water, self.step_s, axis=0)
        return np.asarray(out)

    def coriolis_of(self, mass: Array, nu: Array) -> Array:
        """C(nu) nu, (n, 6), for diagonal masses (6,)."""
        return np.stack([np.broadcast_to(f, len(nu)) for f in coriolis(mass.tolist(), tuple(nu.T))]).T

    @cached_property
    def world(self) -> tuple[Array, Array, Array]:
        """The unit vectors north, east and down in body axes, each (n, 3)."""
        return world_axes(self.euler)

    def in_body(self, north: float | Array, east: float | Array) -> Array:
        """Convert a level earth-fixed vector to body axes, (n, 3); north, east: scalars, or (n,)."""
        to_north, to_east, _ = self.world
        return np.asarray(np.multiply(to_north.T, north).T + np.multiply(to_east.T, east).T)


def world_axes(euler: Array) -> tuple[Array, Array, Array]:
    """The unit vectors north, east and down in body axes, each (n, 3), at roll, pitch and heading (n, 3) (Fossen 2011,
    eq. 2.18)."""
    (sin_r, sin_p, sin_h), (cos_r, cos_p, cos_h) = np.sin(euler).T, np.cos(euler).T
    north = [cos_p * cos_h, sin_r * sin_p * cos_h - cos_r * sin_h, cos_r * sin_p * cos_h + sin_r * sin_h]
    east = [cos_p * sin_h, sin_r * sin_p * sin_h + cos_r * cos_h, cos_r * sin_p * sin_h - sin_r * cos_h]
    down = [-sin_p, sin_r * cos_p, cos_r * cos_p]
    return np.stack(north).T, np.stack(east).T, np.stack(down).T


def runs_at(time_s: Array, runs_s: Sequence[tuple[float, float]]) -> tuple[slice, ...]:
    """The instants (n,) within each run; all of them for a single one."""
    if len(runs_s) < 2:
        return (slice(0, len(time_s)),)
    ends = np.searchsorted(time_s, np.array(runs_s))
    return tuple(slice(int(a), int(b)) for a, b in ends if a < b)


def in_a_run(time_s: Array, runs_s: Sequence[tuple[float, float]]) -> NDArray[np.bool_]:
    """Whether each instant (n,) lies in a run."""
    inside = np.zeros(len(time_s), np.bool_)
    for run in runs_at(time_s, runs_s):
        inside[run] = True
    return inside


def lagged(asked: Array, step_s: float, lag_s: float) -> Array:
    """First-order lag of the demand, (n, k), held over each step; the first value counts as held for ever before."""
    if lag_s <= 0:
        return asked
    return np.asarray(
        _followed(np.ascontiguousarray(asked, np.float64), 1.0 - float(np.exp(-step_s / lag_s)))
    )


def thrust_of(asked: Array, step_s: float, lag_s: float) -> Array:
    """Thrust (n, k) at each instant, first-order lag behind a demand (n, k) that is held over the step after it.

    Without a lag it changes at the instants themselves, and is there midway between before and after.
    """
    if lag_s > 0:
        return lagged(asked, step_s, lag_s)
    return np.asarray(0.5 * (np.concatenate([asked[:1], asked[:-1]]) + asked))


def shaft_lagged(asked: Array, step_s: float, lag_s: float) -> Array:
    """Thrust, (n, k), of shafts whose speed follows that of the demand with a first-order lag; a thrust goes by the
    square of the speed."""
    speed = thrust_of(np.sign(asked) * np.sqrt(np.abs(asked)), step_s, lag_s)
    return np.asarray(speed * np.abs(speed))


@njit(cache=True, nogil=True)
def _followed(asked: Array, share: float) -> Array:
    """First-order tracking, (n, k): each step covers a fixed share of the remaining distance to the demand.

    All columns of a row are followed at once, because each waits for the row before.
    """
    out = np.empty_like(asked)
    for c in range(asked.shape[1]):
        out[0, c] = asked[0, c]
    for i in range(1, asked.shape[0]):
        for c in range(asked.shape[1]):
            out[i, c] = out[i - 1, c] + share * (asked[i - 1, c] - out[i - 1, c])
    return out


def delayed(values: Array, step_s: float, delay_s: float) -> Array:
    """Values of `delay_s` earlier, (n, k), linear between the instants; the ends are held. A negative delay looks
    ahead."""
    return np.asarray(_earlier(np.ascontiguousarray(values, np.float64), delay_s / step_s))


@njit(cache=True, nogil=True)
def _earlier(values: Array, steps: float) -> Array:
    """Values (n, k) of some `steps` earlier."""
    out, count = np.empty_like(values), len(values)
    for i in range(count):
        at = min(max(i - steps, 0.0), count - 1.0)
        low = min(int(at), max(count - 2, 0))
        share, high = at - low, min(low + 1, count - 1)
        for c in range(values.shape[1]):
            out[i, c] = values[low, c] + share * (values[high, c] - values[low, c])
    return out
