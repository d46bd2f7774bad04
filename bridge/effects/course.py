"""What a vehicle did, instant by instant: all that an effect can depend on."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from bridge.vehicle.config import Configuration
from bridge.vehicle.dynamics import coriolis
from bridge.vehicle.thrusters import allocation_matrix

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Course:
    """A vehicle's motion and its nominal model at uniform instants `time_s` (n,), body frame FRD, SI units.

    nu, nu_dot (n, 6): velocity over ground of the body's origin, and its rate in body axes. euler (n, 3): roll, pitch
    and heading, which runs on past pi. depth_m, altitude_m, voltage_v (n,), NaN where nothing tells. position_m (n, 2):
    north and east of where it began. asked_n (n, k): what each thruster is asked for by its nominal curve; rpm (n, k):
    signed shaft speeds, NaN where nothing tells. lag_s: the thrusters' nominal lag. mass, damping (6,): of the nominal
    model, total.
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

    @property
    def step_s(self) -> float:
        return float(self.time_s[1] - self.time_s[0])

    @cached_property
    def thrust_n(self) -> Array:
        """(n, k): what each thruster gives by its nominal curve and lag."""
        return lagged(self.asked_n, self.step_s, self.lag_s)

    @cached_property
    def allocation(self) -> Array:
        """(6, k): the wrench of one newton of each thruster."""
        return allocation_matrix(self.configuration)

    def wrench_of(self, thrust_n: Array) -> Array:
        """(n, 6) of thrusts (n, k)."""
        return np.asarray(thrust_n @ self.allocation.T)

    def coriolis_of(self, mass: Array, nu: Array) -> Array:
        """C(nu) nu, (n, 6), for diagonal masses (6,)."""
        return np.column_stack([np.broadcast_to(f, len(nu)) for f in coriolis(mass.tolist(), tuple(nu.T))])

    def in_body(self, north: float, east: float) -> Array:
        """A level world-fixed vector in body axes, (n, 3) (Fossen 2011, eq. 2.18)."""
        roll, pitch, heading = self.euler.T
        ahead = north * np.cos(heading) + east * np.sin(heading)
        aside = -north * np.sin(heading) + east * np.cos(heading)
        return np.column_stack(
            [
                np.cos(pitch) * ahead,
                np.sin(roll) * np.sin(pitch) * ahead + np.cos(roll) * aside,
                np.cos(roll) * np.sin(pitch) * ahead - np.sin(roll) * aside,
            ]
        )


def lagged(asked: Array, step_s: float, lag_s: float) -> Array:
    """First-order lag of what is asked, (n, k), held over each step; the first value has been held for ever."""
    if lag_s <= 0:
        return asked
    keep = float(np.exp(-step_s / lag_s))
    out = np.empty_like(asked)
    out[0] = asked[0]
    for i in range(1, len(asked)):
        out[i] = asked[i - 1] + keep * (out[i - 1] - asked[i - 1])
    return out
