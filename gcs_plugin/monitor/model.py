"""The model of a vehicle that its coefficients in force describe."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from bridge.arrays import Array
from bridge.vehicle.accepted_effects import Known, known_effects
from bridge.vehicle.coefficients import DAMPINGS, MASSES, QUADRATICS
from bridge.vehicle.config import Configuration, VehicleFile
from bridge.vehicle.thrusters import Curve, allocation_matrix, thrust_curve


@dataclass(frozen=True)
class Model:
    """Model of the vehicle by its accepted coefficients.

    mass, damping, quadratic (6,) in SI units; dofs: the axes whose mass and damping are known. The mass of another
    axis is the rigid body's, for its Coriolis forces. `effects` are the accepted ones."""

    configuration: Configuration
    curve: Curve
    lag_s: float
    delay_s: float
    mass: Array
    damping: Array
    quadratic: Array
    dofs: tuple[int, ...]
    effects: Known

    @cached_property
    def matrix(self) -> Array:
        """Wrench (6, k) per newton of each thruster."""
        return allocation_matrix(self.configuration)


def model_of(coefficients: Mapping[str, float], file: VehicleFile, configuration: str) -> Model | None:
    """The model of coefficients by name (0 or absent: not set); None if they tell the mass and damping of no axis.

    Raises ConfigError for a thrust curve that can't be read.
    """
    shape = file.vehicle.configurations[configuration]
    curve = file.vehicle.thrust_curve
    mass, damping, quadratic = (
        np.array([coefficients.get(row.name, 0.0) for row in rows]) for rows in (MASSES, DAMPINGS, QUADRATICS)
    )
    known = (mass > 0) & ((damping > 0) | (quadratic > 0))
    if not known.any():
        return None
    rigid = np.array([shape.rigid_body(dof)[0] for dof in range(6)])
    return Model(
        shape,
        thrust_curve(curve, file.path.parent),
        curve.lag_s,
        curve.delay_s,
        np.where(known, mass, rigid),
        damping,
        quadratic,
        tuple(int(dof) for dof in np.flatnonzero(known)),
        known_effects(coefficients, shape),
    )
