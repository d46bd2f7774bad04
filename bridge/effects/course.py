"""What a vehicle did, instant by instant: all that an effect can depend on."""

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numba import njit
from numpy.typing import NDArray

from bridge.vehicle.config import Configuration
from bridge.vehicle.dynamics import coriolis
from bridge.vehicle.thrusters import allocation_matrix

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Course:
    """A vehicle's motion and its nominal model at uniform instants `time_s` (n,), body frame FRD, SI units.

    nu, nu_dot (n, 6): velocity of the body's origin through the water as far as that is known, else over ground, and
    its rate in body axes. euler (n, 3): roll, pitch and heading, which runs on past pi. depth_m, altitude_m,
    voltage_v (n,), NaN where nothing tells. position_m (n, 2): north and east of where it began. asked_n (n, k): what
    each thruster is asked for by its nominal curve; rpm (n, k): signed shaft speeds, NaN where nothing tells. lag_s:
    the thrusters' nominal lag. mass, damping (6,): of the nominal model, total. quadratic (6,): drag by the square of
    the speed, as far as it is known. water (n, 3): the water's own velocity, body axes, as far as it is known; None
    for none. drift (n, 3): surge, sway and heave as all readings together show them, nu's own where None: moments are
    made of it, for no gyro tells of it, and what is predicted is off by what readings are. by_wrench: no pulses are
    known, and asked_n (n, 6) is the wrench itself, as if of one thruster in each degree of freedom. Arrays are held
    column by column: most of what is made of them is of one column.
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
    drift: Array | None = None

    @property
    def step_s(self) -> float:
        return float(self.time_s[1] - self.time_s[0])

    @cached_property
    def since_s(self) -> Array:
        """(n,): how long it has been going on."""
        return np.asarray(self.time_s - self.time_s[0])

    @cached_property
    def thrust_n(self) -> Array:
        """(n, k): what each thruster gives by its nominal curve and lag."""
        return lagged(self.asked_n, self.step_s, self.lag_s)

    @cached_property
    def allocation(self) -> Array:
        """(6, k): the wrench of one newton of each thruster."""
        return np.eye(6) if self.by_wrench else allocation_matrix(self.configuration)

    @cached_property
    def added_mass(self) -> Array:
        """(6,): what the water adds to the rigid body by the nominal model."""
        rigid = [self.configuration.dry_mass_kg] * 3 + list(self.configuration.inertia_kgm2)
        return np.asarray(self.mass - np.array(rigid))

    @cached_property
    def over_ground(self) -> tuple[Array, Array]:
        """(n, 6) each: the velocity over ground, and its rate in body axes."""
        if self.water is None:
            return self.nu, self.nu_dot
        nu, nu_dot = self.nu.copy(order="F"), self.nu_dot.copy(order="F")
        nu[:, :3] += self.water
        nu_dot[:, :3] += np.gradient(self.water, self.step_s, axis=0)
        return nu, nu_dot

    @property
    def drifting(self) -> Array:
        """(n, 3): surge, sway and heave as moments go by them."""
        return self.nu[:, :3] if self.drift is None else self.drift

    def drag_of(self, nu: Array) -> Array:
        """What brakes the hull at velocities (n, 6) through the water, (n, 6)."""
        return np.asarray((self.damping + self.quadratic * np.abs(nu)) * nu)

    def wrench_of(self, thrust_n: Array) -> Array:
        """(n, 6) of thrusts (n, k)."""
        return np.asarray((self.allocation @ thrust_n.T).T)

    def turned_by(self, water: Array) -> Array:
        """(n, 6): Coriolis forces that a model of the velocity over ground has too much of in water that moves by
        `water` (n, 3). In proportion to it: the squares of the velocities differ by it times their mean."""
        known = np.zeros_like(self.nu) if self.water is None else np.pad(self.water, ((0, 0), (0, 3)))
        half = np.pad(0.5 * water, ((0, 0), (0, 3)))
        by_drift = self.nu.copy()
        by_drift[:, :3] = self.drifting
        out, moments = (
            self.coriolis_of(self.mass, nu + 0.5 * known + half)
            - self.coriolis_of(self.mass, nu + 0.5 * known - half)
            for nu in (self.nu, by_drift)
        )
        out[:, 3:] = moments[:, 3:]
        return out

    def pushed_by(self, water: Array) -> Array:
        """(n, 6): all that a model of the velocity over ground lacks in water that moves so, where the water that is
        known is no other: beside Coriolis forces drag and inertia."""
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
        """The unit vectors north, east and down in body axes, each (n, 3) (Fossen 2011, eq. 2.18)."""
        (sin_r, sin_p, sin_h), (cos_r, cos_p, cos_h) = np.sin(self.euler).T, np.cos(self.euler).T
        north = [cos_p * cos_h, sin_r * sin_p * cos_h - cos_r * sin_h, cos_r * sin_p * cos_h + sin_r * sin_h]
        east = [cos_p * sin_h, sin_r * sin_p * sin_h + cos_r * cos_h, cos_r * sin_p * sin_h - sin_r * cos_h]
        down = [-sin_p, sin_r * cos_p, cos_r * cos_p]
        return np.stack(north).T, np.stack(east).T, np.stack(down).T

    def in_body(self, north: float | Array, east: float | Array) -> Array:
        """A level world-fixed vector in body axes, (n, 3); north, east: one value, or (n,)."""
        to_north, to_east, _ = self.world
        return np.asarray(np.multiply(to_north.T, north).T + np.multiply(to_east.T, east).T)


def lagged(asked: Array, step_s: float, lag_s: float) -> Array:
    """First-order lag of what is asked, (n, k), held over each step; the first value has been held for ever."""
    if lag_s <= 0:
        return asked
    # One layout, column by column, is compiled once.
    columns = np.ascontiguousarray(asked.T, dtype=np.float64)
    return np.asarray(_followed(columns, 1.0 - float(np.exp(-step_s / lag_s)))).T


@njit(cache=True, nogil=True)
def _followed(columns: Array, share: float) -> Array:
    """(k, n): each comes nearer to its column by a share of what lies between them at each step."""
    out = np.empty_like(columns)
    for c in range(columns.shape[0]):
        now = columns[c, 0]
        out[c, 0] = now
        for i in range(1, columns.shape[1]):
            now += share * (columns[c, i - 1] - now)
            out[c, i] = now
    return out


def delayed(values: Array, step_s: float, delay_s: float) -> Array:
    """What was there `delay_s` ago, (n, k), straight between the instants; the ends are held. Less than 0: ahead."""
    at = np.clip(np.arange(len(values)) - delay_s / step_s, 0.0, len(values) - 1.0)
    low = np.minimum(at.astype(np.intp), max(len(values) - 2, 0))
    share = (at - low)[:, None]
    return np.asarray(values[low] + share * (values[np.minimum(low + 1, len(values) - 1)] - values[low]))
