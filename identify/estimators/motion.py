"""Velocities on a uniform grid, with their Coriolis forces, integrals and means over any interval."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from bridge.vehicle.dynamics import coriolis

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Motion:
    """Velocities `nu` (m, 6) at the uniform times `time_s` (m,), smoothed as their noise requires."""

    time_s: Array
    nu: Array

    @cached_property
    def coriolis(self) -> Array:
        """C(nu) nu in each degree of freedom for a unit of each mass, (6, 6, m); it is linear in the masses."""
        nu = tuple(self.nu.T)
        of_each = [coriolis(unit_mass, nu) for unit_mass in np.eye(6).tolist()]
        return np.stack([np.broadcast_arrays(*of_one, nu[0])[:6] for of_one in of_each], axis=1)

    def integral(self, values: Array) -> Array:
        """Integral of values at the times, (m,), by the trapezium rule."""
        steps = 0.5 * (values[1:] + values[:-1]) * np.diff(self.time_s)
        return np.concatenate([[0.0], np.cumsum(steps)])

    def mean_between(self, values: Array, start_s: Array, end_s: Array) -> Array:
        """Mean (n,) over each interval of values at the times, (m,); 0 for an empty interval."""
        total = self.integral(values)
        span_s = end_s - start_s
        area = np.interp(end_s, self.time_s, total) - np.interp(start_s, self.time_s, total)
        return np.asarray(np.where(span_s > 0, area / np.where(span_s > 0, span_s, 1.0), 0.0))


NO_MOTION = Motion(np.zeros(0), np.zeros((0, 6)))
