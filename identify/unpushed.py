"""Refuses dives in which no thruster pushed: the only kind of recording that can't be identified at all."""

import numpy as np
from numpy.typing import NDArray

from bridge.errors import FitError
from bridge.vehicle.config import VehicleFile
from identify.dive import Dive
from identify.forces import WrenchHistory, wrench

Array = NDArray[np.float64]

BRAKED_S = 10.0
"""Longest time constant of a vehicle, mass over damping. Without added mass it overestimates the speed."""

LEAST_M_S, LEAST_RAD_S = 0.005, 0.01
"""Smallest speed under thrust that a DVL or a gyro resolves."""

DRIVEN = {0: LEAST_M_S, 1: LEAST_M_S, 2: LEAST_M_S, 3: LEAST_RAD_S, 4: LEAST_RAD_S, 5: LEAST_RAD_S}


def refuse_unpushed(dive: Dive, file: VehicleFile, configuration: str) -> None:
    """Raise FitError if no thruster pushed enough to move the vehicle."""
    if dive.armed is not None and len(dive.armed) and not np.any(dive.armed.value > 0):
        raise FitError(
            "the vehicle was never armed (HEARTBEAT), so no thruster pushed in all the dive and nothing "
            "can be told of what thrust does; arm it, and dive again with starts, stops and turns under thrust",
            of=dive.name,
        )
    shape = file.vehicle.configurations[configuration]
    forces = wrench(dive, file, configuration)
    if not np.nanmax(np.abs(forces.asked), initial=0.0) > 0.0:
        raise FitError(
            "no thruster pushed in all the dive: every command is neutral, or too small to turn a "
            "propeller, so nothing can be told of what thrust does; dive again with starts, stops and turns under "
            "thrust, or check which outputs were recorded",
            of=dive.name,
        )
    mass = np.array([shape.rigid_body(dof)[0] for dof in range(6)])
    fastest = np.max(np.abs(_driven(forces, mass)), axis=0)
    if all(fastest[dof] < least for dof, least in DRIVEN.items()):
        raise FitError(
            f"the thrusters hardly pushed: by them alone the vehicle never goes faster than "
            f"{1000 * max(fastest[:3]):.1f} mm/s, less than its sensors tell, so nothing can be told of what thrust "
            "does; dive again with starts, stops and turns under thrust",
            of=dive.name,
        )


def _driven(forces: WrenchHistory, mass: Array) -> Array:
    """Speeds (m, 6) from the commands alone, for mass (6,) and the longest time constant."""
    held_s = np.diff(forces.time_s)
    keep = np.exp(-held_s / BRAKED_S)
    push = BRAKED_S * (1.0 - keep)[:, None] * np.nan_to_num(forces.asked[:-1]) / mass
    out, speed = np.zeros((len(forces.time_s), 6)), np.zeros(6)
    for k, factor in enumerate(keep.tolist()):
        speed = factor * speed + push[k]
        out[k + 1] = speed
    return out
