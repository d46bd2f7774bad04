"""How strongly a hidden effect moved the vehicle: relative to the thrust, and to the sea after a refit."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bench.field.export import down
from bench.field.simulate import Flown
from bridge.vehicle.coefficients import DOFS
from bridge.vehicle.config import GRAVITY_M_S2
from bridge.vehicle.thrusters import allocation_matrix
from identify.challenge.nearest import nominal_columns

Array = NDArray[np.float64]


TILT = 0.01
"""A smaller tilt, rad, can't be seen reliably."""


@dataclass(frozen=True)
class Felt:
    """Strength of the effect by degree of freedom, (6,) each.

    of_thrust: rms of the planted wrench over that of the thrust; over_sea: rms of the part that a refit of masses,
    linear and quadratic dampings leaves, over the standard deviation of the sea.
    """

    of_thrust: Array
    over_sea: Array

    @property
    def size(self) -> float:
        """The largest `over_sea` of all degrees of freedom."""
        return float(self.over_sea.max())

    @property
    def where(self) -> str:
        return DOFS[int(self.over_sea.argmax())]


def missing_wrench(flown: Flown) -> Array:
    """Wrench (n, 6), N and N m, that is missing at the ticks.

    It is the total wrench less the true model's, quadratic drag included, which takes thrust from the pulses by the
    crew's curve and lag, and less the sea's.
    """
    vehicle, ticks = flown.site.vehicle, flown.ticks
    shape = vehicle.configuration
    modelled = _columns(flown) @ np.concatenate([vehicle.mass, vehicle.linear, vehicle.quadratic])
    below = down(ticks.state)
    righting = shape.dry_mass_kg * GRAVITY_M_S2 * shape.centre_of_gravity_below_buoyancy_m
    modelled[:, :3] += shape.net_buoyancy_n * below
    modelled[:, 3] += righting * below[:, 1]
    modelled[:, 4] -= righting * below[:, 0]
    return np.asarray(modelled - ticks.nominal @ allocation_matrix(shape).T - flown.sea)


def felt(flown: Flown, std: Array) -> Felt:
    """Strength of a dive's effect in a sea of standard deviation `std` (6,).

    In roll and pitch the sea counts as at least the moment that tilts the vehicle by TILT.
    """
    shape = flown.site.vehicle.configuration
    tilts = TILT * shape.dry_mass_kg * GRAVITY_M_S2 * shape.centre_of_gravity_below_buoyancy_m
    std = np.maximum(std, np.array([0.0, 0.0, 0.0, tilts, tilts, 0.0]))
    gap = missing_wrench(flown)
    if not np.isfinite(gap).all():
        # The planted effect made the vehicle turn over ever faster. That is no dive, and it will be drawn again.
        return Felt(np.full(6, np.inf), np.full(6, np.inf))
    thrust = flown.ticks.nominal @ allocation_matrix(flown.site.vehicle.configuration).T
    rms = np.sqrt(np.mean(thrust**2, axis=0))
    table, value = (_columns(flown) / std[None, :, None]).reshape(-1, 18), (gap / std).reshape(-1)
    left = value - table @ np.linalg.lstsq(table, value, rcond=None)[0]
    of_thrust = np.divide(np.sqrt(np.mean(gap**2, axis=0)), rms, out=np.zeros(6), where=rms > 1e-6)
    return Felt(of_thrust, np.sqrt(np.mean(left.reshape(-1, 6) ** 2, axis=0)))


def _columns(flown: Flown) -> Array:
    """Table (n, 6, 18): the wrench per unit of each mass, linear and quadratic damping."""
    nu = flown.ticks.state[:, 7:13]
    squares = np.zeros((len(nu), 6, 6))
    for j in range(6):
        squares[:, j, j] = np.abs(nu[:, j]) * nu[:, j]
    return np.concatenate([nominal_columns(nu, flown.ticks.nu_dot), squares], axis=2)
