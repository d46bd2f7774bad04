"""Did any thruster push the vehicle? Where none did, nothing in a dive tells of a model that thrust drives."""

import numpy as np
from numpy.typing import NDArray

from bridge.errors import FitError
from bridge.vehicle.config import VehicleFile
from identify.dive import Dive
from identify.forces import WrenchHistory, wrench

Array = NDArray[np.float64]

BRAKED_S = 10.0
"""A vehicle's mass over its damping, where it is braked least: without added mass, too, this makes of thrust more
speed than there was."""

LEAST_M_S, LEAST_RAD_S = 0.005, 0.01
"""A thrust that never makes more speed than that moves the vehicle by less than a DVL or a gyro tells."""

DRIVEN = {0: LEAST_M_S, 1: LEAST_M_S, 2: LEAST_M_S, 5: LEAST_RAD_S}
"""Degrees of freedom that thrust moves: roll and pitch are righted."""


def refuse_unpushed(dive: Dive, file: VehicleFile, configuration: str) -> None:
    """Raises FitError where no thruster ever pushed, or so little that the vehicle can't have moved by it."""
    shape = file.vehicle.configurations[configuration]
    forces = wrench(dive, file, configuration)
    if not np.nanmax(np.abs(forces.asked), initial=0.0) > 0.0:
        raise FitError(
            f"{dive.name}: no thruster pushed in all the dive: every command is neutral, or too small to turn a "
            "propeller, so nothing can be told of what thrust does; dive again with starts, stops and turns under "
            "thrust, or check which outputs were recorded"
        )
    mass = np.array([shape.rigid_body(dof)[0] for dof in range(6)])
    fastest = np.max(np.abs(_driven(forces, mass)), axis=0)
    if all(fastest[dof] < least for dof, least in DRIVEN.items()):
        raise FitError(
            f"{dive.name}: the thrusters hardly pushed: by them alone the vehicle never goes faster than "
            f"{1000 * max(fastest[:3]):.1f} mm/s, less than its sensors tell, so nothing can be told of what thrust "
            "does; dive again with starts, stops and turns under thrust"
        )


def _driven(forces: WrenchHistory, mass: Array) -> Array:
    """(m, 6): speeds that the commands alone would make of a body of that mass (6,), braked as little as any."""
    held_s = np.diff(forces.time_s)
    keep = np.exp(-held_s / BRAKED_S)
    push = BRAKED_S * (1.0 - keep)[:, None] * np.nan_to_num(forces.asked[:-1]) / mass
    out, speed = np.zeros((len(forces.time_s), 6)), np.zeros(6)
    for k, one in enumerate(keep.tolist()):
        speed = one * speed + push[k]
        out[k + 1] = speed
    return out
