"""Thruster commands from -1 to 1 as the pulses that a vehicle's thrust curve knows, and shaft speeds as its thrusts."""

from dataclasses import replace
from typing import Final

import numpy as np

from bridge.errors import LogError
from bridge.vehicle.config import VehicleFile
from bridge.vehicle.thrusters import thrust_by_shaft, thrust_curve
from identify.dive import Dive, Signal

MOST: Final = 1.05
"""A command a little beyond full is a controller's that does not limit itself."""


def with_pulses(dive: Dive, vehicle: VehicleFile) -> Dive:
    """The dive with pulses in place of commands from -1 to 1: 0 is neutral, 1 and -1 are the ends of the thrust curve.
    Where nothing but the shafts' speeds was recorded, it gets their thrust.

    Raises LogError for commands beyond that, ConfigError for a thrust table that can't be read.
    """
    effort = dive.effort
    if effort is None:
        return _with_thrust_of_shafts(dive, vehicle)
    largest = float(np.nanmax(np.abs(effort.value), initial=0.0))
    if largest > MOST:
        raise LogError(
            f"its normalised thruster commands reach {largest:.4g}, and they lie within -1 to 1; give "
            "them their unit in the column map, or a scale (0.01 for per cent)",
            dive.source,
        )
    curve = thrust_curve(vehicle.vehicle.thrust_curve, vehicle.path.parent)
    astern_us, ahead_us = curve.ends_us
    value = np.clip(effort.value, -1.0, 1.0)
    span_us = np.where(value < 0, curve.neutral_us - astern_us, ahead_us - curve.neutral_us)
    return replace(dive, pwm=Signal(effort.time_s, curve.neutral_us + value * span_us), effort=None)


def _with_thrust_of_shafts(dive: Dive, vehicle: VehicleFile) -> Dive:
    rpm = dive.rpm
    if rpm is None or dive.thruster_commands is not None or dive.tau_cmd is not None:
        return dive
    curve = vehicle.vehicle.thrust_curve
    lagging = f", and lag_s: 0, as a measured speed has no lag of {curve.lag_s:g} s" if curve.lag_s else ""
    note = (
        "No thruster command is recorded: the thrust is that of the shafts' speeds, by forward_n_s2 and reverse_n_s2 "
        f"of the vehicle file's thrust_curve; check these{lagging}."
    )
    thrust = Signal(rpm.time_s, thrust_by_shaft(curve, rpm.value))
    return replace(dive, thrust_cmd=thrust, notes=(*dive.notes, note))
