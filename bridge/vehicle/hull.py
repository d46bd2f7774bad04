"""What a model hangs on: the mass, inertia and thrusters of a vehicle file, as one short text to compare."""

import hashlib
import json
from pathlib import Path
from typing import Final

import numpy as np

from bridge.vehicle.config import Vehicle
from bridge.vehicle.thrusters import thrust_curve

DIGITS: Final = 16
PULSES_US: Final = np.arange(1000.0, 2001.0, 5.0)
THRUST_DECIMALS: Final = 3
"""A mN: no two curves that differ by less give another model, and no rounding of a table is seen as another curve."""


def hull_mark(vehicle: Vehicle, directory: Path) -> str:
    """The same 16 hexadecimal digits for every file that describes the same hull and thrusters; it lies in `directory`.

    In it are of each configuration its index, mass, inertia, trim and thrusters, and how pulses become thrust, of a
    table its very numbers. Names, devices, water, gains, priors and the file's own `model` are not.
    Raises ConfigError for a thrust table that can't be read.
    """
    shapes = [
        (
            vehicle.veh_cfg(name),
            shape.dry_mass_kg,
            shape.inertia_kgm2,
            shape.centre_of_gravity_below_buoyancy_m,
            shape.net_buoyancy_n,
            shape.thruster_limit_n,
            [(thruster.direction, thruster.position_m, thruster.gain) for thruster in shape.thrusters],
        )
        for name, shape in vehicle.configurations.items()
    ]
    curve = vehicle.thrust_curve
    thrust_n = thrust_curve(curve, directory).thrust(PULSES_US)
    # A curve's zero may come out as -0.0, which is written otherwise.
    thrusts_n = (np.round(thrust_n, THRUST_DECIMALS) + 0.0).tolist()
    told = json.dumps((sorted(shapes), curve.lag_s, curve.forward_n_s2, curve.reverse_n_s2, thrusts_n))
    return hashlib.sha256(told.encode()).hexdigest()[:DIGITS]
