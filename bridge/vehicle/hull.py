"""Hash of the hull that a model depends on: mass, inertia and thrusters of a vehicle file, as a short text to
compare."""

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
"""Millinewtons: curves that differ by less give the same model, and rounding in a table does not look like a new
curve."""


def hull_mark(vehicle: Vehicle, directory: Path) -> str:
    """Return 16 hexadecimal digits that are equal for all files that describe the same hull and thrusters.

    The file lies in `directory`. The hash covers, for each configuration, its index, mass, inertia, trim and
    thrusters, and the conversion of pulses to thrust and shaft speed, with its lag and dead time (of a table, the
    numbers and not the name). It excludes names, devices, water, gains, priors and the file's own `model`. Raises
    ConfigError if a thrust table can't be read.
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
    # A curve's zero may come out as -0.0, whose text differs.
    thrusts_n = (np.round(thrust_n, THRUST_DECIMALS) + 0.0).tolist()
    thrust = (curve.lag_s, curve.forward_n_s2, curve.reverse_n_s2, thrusts_n)
    # Without a dead time the mark is that of files written before there was one.
    dead_time = (curve.delay_s,) if curve.delay_s else ()
    description = json.dumps((sorted(shapes), *thrust, *dead_time))
    return hashlib.sha256(description.encode()).hexdigest()[:DIGITS]
