"""How much of what moved a vehicle its hidden effect was: beside the thrust, and over the sea once a refit is done."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bench.field.export import down
from bench.field.simulate import Flown
from bridge.vehicle.coefficients import DOFS
from bridge.vehicle.config import GRAVITY_M_S2
from bridge.vehicle.thrusters import allocation_matrix
from identify.challenge.gap import nominal_columns

Array = NDArray[np.float64]


TILT = 0.01
"""rad: less is not seen for sure."""


@dataclass(frozen=True)
class Felt:
    """By degree of freedom, (6,) each: rms of the planted wrench over that of the thrust; rms of what a refit of
    masses, linear and quadratic dampings leaves of it over the standard deviation of the sea."""

    of_thrust: Array
    over_sea: Array

    @property
    def size(self) -> float:
        """Over the sea, where it is largest."""
        return float(self.over_sea.max())

    @property
    def where(self) -> str:
        return DOFS[int(self.over_sea.argmax())]


def missing_wrench(flown: Flown) -> Array:
    """(n, 6) N and N m at the ticks: what moved the vehicle less what its true model, quadratic drag included, makes of
    the pulses by the crew's curve and lag, and less the sea."""
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
    """Of a dive in a sea of that standard deviation (6,); in roll and pitch at least of what tilts it by TILT."""
    shape = flown.site.vehicle.configuration
    tilts = TILT * shape.dry_mass_kg * GRAVITY_M_S2 * shape.centre_of_gravity_below_buoyancy_m
    std = np.maximum(std, np.array([0.0, 0.0, 0.0, tilts, tilts, 0.0]))
    gap = missing_wrench(flown)
    if not np.isfinite(gap).all():
        # What is planted made the vehicle turn over faster and faster: it is no dive, and will be drawn anew.
        return Felt(np.full(6, np.inf), np.full(6, np.inf))
    thrust = flown.ticks.nominal @ allocation_matrix(flown.site.vehicle.configuration).T
    rms = np.sqrt(np.mean(thrust**2, axis=0))
    table, value = (_columns(flown) / std[None, :, None]).reshape(-1, 18), (gap / std).reshape(-1)
    left = value - table @ np.linalg.lstsq(table, value, rcond=None)[0]
    of_thrust = np.divide(np.sqrt(np.mean(gap**2, axis=0)), rms, out=np.zeros(6), where=rms > 1e-6)
    return Felt(of_thrust, np.sqrt(np.mean(left.reshape(-1, 6) ** 2, axis=0)))


def _columns(flown: Flown) -> Array:
    """(n, 6, 18): the wrench of each mass, linear and quadratic damping."""
    nu = flown.ticks.state[:, 7:13]
    squares = np.zeros((len(nu), 6, 6))
    for j in range(6):
        squares[:, j, j] = np.abs(nu[:, j]) * nu[:, j]
    return np.concatenate([nominal_columns(nu, flown.ticks.nu_dot), squares], axis=2)
