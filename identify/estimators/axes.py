"""From a dive to what the filter eats: for each degree of freedom its readings in time order, and the forces.

Coriolis forces couple the axes through products of velocities; they are formed from the smoothed measured
velocities, which leaves six filters of one axis each instead of one of twelve states. The error of that is the
smoothed noise of one velocity times another velocity, well under the disturbance that every axis carries anyway.
"""

from dataclasses import dataclass
from typing import TypeGuard

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter1d

from bridge.vehicle.config import GRAVITY_M_S2, Configuration, VehicleFile
from bridge.vehicle.dynamics import restoring
from identify.dive import Dive, Signal
from identify.estimators.innovations import POSITION, VELOCITY
from identify.forces import WrenchHistory, wrench

Array = NDArray[np.float64]

GRID_S = 0.02
SMOOTHING_S = 0.2
FIRST_POSITION_STD = 0.1
LEAST_START_S = 0.5
LEAST_DRIVE = 1e-3
"""Thrust in an axis below this share of one thruster's limit (N, or N m) weighs nothing."""
HEAVE, ROLL, PITCH, YAW = 2, 3, 4, 5

# Coriolis force on each axis as (sign, mass, velocity, velocity): force_i = sum of sign M[mass] nu[a] nu[b],
# the minus C(nu) nu of bridge.vehicle.dynamics for a diagonal mass matrix.
CORIOLIS = (
    ((1, 1, 1, 5), (-1, 2, 2, 4)),
    ((1, 2, 2, 3), (-1, 0, 0, 5)),
    ((1, 0, 0, 4), (-1, 1, 1, 3)),
    ((1, 1, 1, 2), (-1, 2, 1, 2), (1, 4, 4, 5), (-1, 5, 4, 5)),
    ((1, 2, 0, 2), (-1, 0, 0, 2), (1, 5, 3, 5), (-1, 3, 3, 5)),
    ((1, 0, 0, 1), (-1, 1, 0, 1), (1, 3, 3, 4), (-1, 4, 3, 4)),
)


@dataclass(frozen=True)
class Axis:
    """One degree of freedom, (n,) events in time order.

    force: mean thrust less restoring over the step before the event. coriolis (n, 6): force for each unit of
    each total mass. channel: which of `channels` was read. stiffness: restoring moment by angle, for roll and
    pitch. initial (4,): first speed and angle or depth, and their variances.
    """

    dof: int
    time_s: Array
    step_s: Array
    force: Array
    coriolis: Array
    reading: Array
    state_read: NDArray[np.int64]
    channel: NDArray[np.int64]
    channels: tuple[str, ...]
    stiffness: float
    initial: Array


def smoothed_velocity(dive: Dive, time_s: Array) -> Array:
    """nu on a uniform grid (m,), (m, 6), through a zero-phase Gaussian; 0 where nothing was measured."""
    out = np.zeros((len(time_s), 6))
    spacing = time_s[1] - time_s[0]
    sources = [(slice(0, 3), dive.velocity), (slice(3, 6), dive.gyro)]
    if dive.fog is not None and len(dive.fog) > 1:
        sources.append((slice(5, 6), dive.fog))
    for columns, signal in sources:
        if signal is not None and len(signal) > 1:
            values = np.nan_to_num(signal.at(time_s))
            out[:, columns] = gaussian_filter1d(values, SMOOTHING_S / spacing, axis=0)
    return out


def build_axes(dive: Dive, file: VehicleFile, name: str) -> tuple[tuple[Axis, ...], tuple[str, ...]]:
    """The axes that this dive has readings and forces for, and notes on where the forces came from.

    Raises FitError where the dive holds no thruster command at all.
    """
    vehicle = file.vehicle
    configuration = vehicle.configurations[name]
    forces = wrench(dive, file, name)
    # What the thrusters did before the first command is unknown; ten lags later it no longer matters.
    start, end = float(forces.time_s[0]) + max(10 * forces.lag_s, LEAST_START_S), float(forces.time_s[-1])
    grid = np.arange(start, end, GRID_S)
    nu = smoothed_velocity(dive, grid)
    attitude = None if dive.attitude is None else dive.attitude.at(grid)
    lever = (0.0, 0.0, 0.0) if vehicle.sensors.dvl is None else vehicle.sensors.dvl.mounting.position_m
    at_transducer = np.cross(nu[:, 3:], np.asarray(lever))
    depth = _depth(dive, file, grid, nu, attitude)
    axes = []
    for dof in range(6):
        readings = _readings(dive, dof, grid, at_transducer)
        if dof == HEAVE and readings and depth is not None:
            readings.append(("depth", depth.time_s, depth.value[:, 0], POSITION))
        if readings and np.std(forces.asked[:, dof]) > LEAST_DRIVE * configuration.thruster_limit_n:
            axis = _axis(dof, readings, configuration, forces, grid, nu, attitude, (start, end))
            if axis is not None:
                axes.append(axis)
    return tuple(axes), forces.notes


def _depth(dive: Dive, file: VehicleFile, grid: Array, nu: Array, attitude: Array | None) -> Signal | None:
    """The integral of heave velocity: measured depth less what surge and sway of a tilted body add to it.

    The controller acts on depth, so depth has to be among the readings.
    """
    depth = dive.depth_by(file.vehicle.water)
    if depth is None or len(depth) < 5:
        return None
    if attitude is None:
        return depth
    w, x, y, z = attitude.T
    by_tilt = 2 * (x * z - w * y) * nu[:, 0] + 2 * (y * z + w * x) * nu[:, 1]
    carried = np.interp(depth.time_s, grid, np.cumsum(by_tilt) * (grid[1] - grid[0]))
    return Signal(depth.time_s, depth.value - carried[:, None])


def _readings(dive: Dive, dof: int, grid: Array, at_transducer: Array) -> list[tuple[str, Array, Array, int]]:
    """(channel, times, values, state read) of all that measures this axis."""
    found: list[tuple[str, Array, Array, int]] = []
    if dof < 3:
        if dive.velocity is not None and len(dive.velocity) > 1:
            carried = np.interp(dive.velocity.time_s, grid, at_transducer[:, dof])
            found.append(("dvl", dive.velocity.time_s, dive.velocity.value[:, dof] - carried, VELOCITY))
        return found
    rates = [("fog", dive.fog, 0)] if dof == YAW else []
    rates += [("gyro", dive.gyro, dof - 3)]
    known = [(name, signal, column) for name, signal, column in rates if _moves(signal, column)]
    if known:
        name, signal, column = max(known, key=lambda rate: _information(*rate[1:]))
        found.append((name, signal.time_s, signal.value[:, column], VELOCITY))
    if dof in (ROLL, PITCH) and dive.attitude is not None and len(dive.attitude) > 1:
        w, x, y, z = dive.attitude.value.T
        down_x, down_y, down_z = 2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)
        angle = np.arctan2(down_y, down_z) if dof == ROLL else np.arcsin(np.clip(-down_x, -1, 1))
        found.append(("attitude", dive.attitude.time_s, angle, POSITION))
    return found


def _moves(signal: Signal | None, column: int) -> TypeGuard[Signal]:
    return (
        signal is not None
        and len(signal) > 4
        and bool(np.nanmax(signal.value[:, column]) > np.nanmin(signal.value[:, column]))
    )


def noise_std(values: Array) -> float:
    """Standard deviation of the white noise on a smooth signal (n,): its third difference is noise alone."""
    values = values[np.isfinite(values)]
    if len(values) < 5:
        return 0.0
    return float(np.median(np.abs(np.diff(values, 3))) / (0.6745 * np.sqrt(20.0)))


def _information(signal: Signal, column: int) -> float:
    return signal.rate_hz / max(noise_std(signal.value[:, column]), 1e-9) ** 2


def _axis(
    dof: int,
    readings: list[tuple[str, Array, Array, int]],
    configuration: Configuration,
    forces: WrenchHistory,
    grid: Array,
    nu: Array,
    attitude: Array | None,
    span_s: tuple[float, float],
) -> Axis | None:
    time_s = np.concatenate([r[1] for r in readings])
    value = np.concatenate([r[2] for r in readings])
    state = np.concatenate([np.full(len(r[1]), r[3], dtype=np.int64) for r in readings])
    channel = np.concatenate([np.full(len(r[1]), i, dtype=np.int64) for i, r in enumerate(readings)])
    keep = (time_s >= span_s[0]) & (time_s <= span_s[1]) & np.isfinite(value)
    order = np.argsort(time_s[keep], kind="stable")
    time_s, value, state, channel = (a[keep][order] for a in (time_s, value, state, channel))
    if len(time_s) < 2:
        return None
    before = np.concatenate([time_s[:1], time_s[:-1]])
    step_s = time_s - before
    force = forces.mean_between(before, time_s)[:, dof]
    middle = 0.5 * (before + time_s)
    stiffness = 0.0
    if dof in (ROLL, PITCH):
        stiffness = (
            configuration.centre_of_gravity_below_buoyancy_m * configuration.dry_mass_kg * GRAVITY_M_S2
        )
    elif attitude is not None:
        g = restoring(configuration, tuple(attitude.T))[dof]
        force = force - np.interp(middle, grid, g)
    elif dof == 2:
        force = force - configuration.net_buoyancy_n
    coriolis = np.zeros((len(time_s), 6))
    for sign, mass, a, b in CORIOLIS[dof]:
        coriolis[:, mass] += sign * np.interp(middle, grid, nu[:, a] * nu[:, b])
    names = tuple(r[0] for r in readings)
    first = value[state == VELOCITY]
    place = value[state == POSITION][:1].sum()
    initial = np.array([first[0], place, max(float(np.std(first)), 1e-4) ** 2, FIRST_POSITION_STD**2])
    return Axis(dof, time_s, step_s, force, coriolis, value, state, channel, names, stiffness, initial)
