"""From a dive to what the filter eats: for each degree of freedom its readings in time order, and the forces.

Coriolis forces couple the axes through products of velocities; they are formed from the smoothed measured
velocities, which leaves six filters of one axis each instead of one of twelve states. The error of that is the
smoothed noise of one velocity times another velocity, well under the disturbance that every axis carries anyway.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bridge.vehicle.coefficients import DOFS
from bridge.vehicle.config import GRAVITY_M_S2, Configuration, Vehicle, VehicleFile
from bridge.vehicle.dynamics import coriolis as _coriolis
from bridge.vehicle.dynamics import restoring
from identify.dive import Dive, Signal
from identify.estimators.innovations import INCREMENT, POSITION
from identify.estimators.readings import FEWEST, PITCH, ROLL, Channel, channels
from identify.estimators.smoothing import smoothed_velocity
from identify.forces import WrenchHistory, wrench
from identify.ingest.rotation import attitude_at

Array = NDArray[np.float64]

GRID_S = 0.02
FIRST_POSITION_STD = 0.1
LEAST_START_S = 0.5
LEAST_COMMANDS_HZ = 4.0
STRANGE_SHARE, TELLING_SHARE = 0.5, 0.15
LEAST_DRIVE = 1e-3
"""Thrust in an axis below this share of one thruster's limit (N, or N m) weighs nothing."""


@dataclass(frozen=True)
class Axis:
    """One degree of freedom, (n,) events in time order.

    force (n, 2): thrust less restoring in the first and the second half of the step before the event.
    coriolis (n, 6): force for each unit of each total mass. scale: standard deviation of a reading over its
    channel's noise. channel: which of `channels` was read. stiffness: restoring moment by angle, for roll and
    pitch. initial (4,): first speed and angle or depth, and their variances.
    """

    dof: int
    time_s: Array
    step_s: Array
    force: Array
    coriolis: Array
    reading: Array
    scale: Array
    state_read: NDArray[np.int64]
    channel: NDArray[np.int64]
    channels: tuple[Channel, ...]
    stiffness: float
    initial: Array


@dataclass(frozen=True)
class Axes:
    """The axes that a dive says something of, why it says nothing of the others, and notes on the forces.

    strange: why the recording can hardly be one of this vehicle in this configuration, empty where it can.
    """

    axes: tuple[Axis, ...]
    missing: dict[int, str]
    notes: tuple[str, ...]
    strange: str = ""


def build_axes(dive: Dive, file: VehicleFile, name: str) -> Axes:
    """The axes that this dive has readings and forces for.

    Raises FitError where the dive holds no thruster command at all.
    """
    vehicle = file.vehicle
    configuration = vehicle.configurations[name]
    forces = wrench(dive, file, name)
    rate_hz = 1.0 / max(float(np.median(np.diff(forces.time_s))), 1e-9) if len(forces.time_s) > 1 else 0.0
    if rate_hz < LEAST_COMMANDS_HZ:
        reason = f"thruster commands come at {rate_hz:.1f} Hz, too rarely to know the force between them"
        return Axes((), dict.fromkeys(range(6), reason), forces.notes)
    # What the thrusters did before the first command is unknown; ten lags later it no longer matters.
    start, end = float(forces.time_s[0]) + max(10 * forces.lag_s, LEAST_START_S), float(forces.time_s[-1])
    grid = np.arange(start, max(end, start + 10 * GRID_S), GRID_S)
    nu = smoothed_velocity(dive, grid)
    attitude = None if dive.attitude is None else attitude_at(dive.attitude, grid)
    lever = (0.0, 0.0, 0.0) if vehicle.sensors.dvl is None else vehicle.sensors.dvl.mounting.position_m
    velocity = _at_origin(dive.velocity, grid, nu, np.asarray(lever))
    depth = _depth(dive, file, grid, nu, attitude)
    axes, missing = [], {}
    for dof in range(6):
        found = channels(dive, dof, velocity, depth)
        if not found:
            missing[dof] = f"no {'velocity' if dof < 3 else 'rate of turn'} in {DOFS[dof]} was recorded"
        elif np.std(forces.asked[:, dof]) <= LEAST_DRIVE * configuration.thruster_limit_n:
            missing[dof] = f"the thrusters never pushed in {DOFS[dof]}: there is no force to weigh it by"
        elif (axis := _axis(dof, found, configuration, forces, grid, nu, attitude, (start, end))) is None:
            missing[dof] = f"{DOFS[dof]} was recorded only while no thruster command was"
        else:
            axes.append(axis)
    return Axes(tuple(axes), missing, forces.notes, _strange(dive, forces, vehicle, name))


def _strange(dive: Dive, forces: WrenchHistory, vehicle: Vehicle, name: str) -> str:
    said = dive.configuration_index()
    if said is not None and said != vehicle.veh_cfg(name):
        return (
            f"the recording says VEH_CFG {said}, configuration '{name}' of vehicle '{vehicle.name}' is "
            f"{vehicle.veh_cfg(name)}: it was dived in another configuration, or is another vehicle's"
        )
    differs = forces.differs_rms
    if differs is not None and dive.tau_cmd is not None:
        commanded = np.sqrt(np.mean(dive.tau_cmd.value**2, axis=0))
        limit = vehicle.configurations[name].thruster_limit_n
        # Small thrust lies in the thrusters' dead band, and the command with it: it tells nothing of the geometry.
        told = [
            dof
            for dof, share in ((0, 1.0), (1, 1.0), (5, 0.5))
            if commanded[dof] > share * TELLING_SHARE * limit
        ]
        worst = max(told, key=lambda dof: float(differs[dof] / commanded[dof]), default=0)
        if told and differs[worst] > STRANGE_SHARE * commanded[worst]:
            return (
                f"in {DOFS[worst]} its thruster commands come to a wrench {differs[worst]:.2g} rms off the "
                f"recorded TAU_CMD of {commanded[worst]:.2g}: the vehicle file's thrusters are not this vehicle's"
            )
    return ""


def _at_origin(velocity: Signal | None, grid: Array, nu: Array, lever: Array) -> Signal | None:
    """Velocity (n, 3) at the body's origin, from that at the DVL's transducer `lever` away."""
    if velocity is None or not lever.any():
        return velocity
    by_turning = np.cross(nu[:, 3:], lever)
    carried = np.column_stack([np.interp(velocity.time_s, grid, by_turning[:, i]) for i in range(3)])
    return Signal(velocity.time_s, velocity.value - carried)


def _depth(dive: Dive, file: VehicleFile, grid: Array, nu: Array, attitude: Array | None) -> Signal | None:
    """The integral of heave velocity: measured depth less what surge and sway of a tilted body add to it.

    None where depth is not recorded.
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


def _axis(
    dof: int,
    found: list[Channel],
    configuration: Configuration,
    forces: WrenchHistory,
    grid: Array,
    nu: Array,
    attitude: Array | None,
    span_s: tuple[float, float],
) -> Axis | None:
    time_s = np.concatenate([c.time_s for c in found])
    value = np.concatenate([c.value for c in found])
    scale = np.concatenate([c.scale for c in found])
    state = np.concatenate([np.full(len(c.time_s), c.state_read, dtype=np.int64) for c in found])
    channel = np.concatenate([np.full(len(c.time_s), i, dtype=np.int64) for i, c in enumerate(found)])
    keep = np.flatnonzero((time_s >= span_s[0]) & (time_s <= span_s[1]))
    order = keep[np.argsort(time_s[keep], kind="stable")]
    time_s, value, scale, state, channel = (a[order] for a in (time_s, value, scale, state, channel))
    if np.count_nonzero(np.isfinite(value) & (state != POSITION)) < FEWEST:
        return None
    # An increment that began before the first event is no whole one.
    whole = state != INCREMENT
    value = np.where(whole | (np.cumsum(~whole) > 1), value, np.nan)
    before = np.concatenate([time_s[:1], time_s[:-1]])
    step_s = time_s - before
    middle = 0.5 * (before + time_s)
    force = forces.halves_between(before, time_s)[:, :, dof]
    stiffness = 0.0
    if dof in (ROLL, PITCH):
        stiffness = (
            configuration.centre_of_gravity_below_buoyancy_m * configuration.dry_mass_kg * GRAVITY_M_S2
        )
    elif attitude is not None:
        g = restoring(configuration, tuple(attitude.T))[dof]
        force = force - np.interp(middle, grid, g)[:, None]
    elif dof == 2:
        force = force - configuration.net_buoyancy_n
    between = np.column_stack([np.interp(middle, grid, nu[:, i]) for i in range(6)])
    # C(nu) nu is linear in the masses: what each contributes is what a mass of one alone would.
    coriolis = np.column_stack(
        [np.broadcast_to(-_coriolis(one, tuple(between.T))[dof], middle.shape) for one in np.eye(6).tolist()]
    )
    return Axis(
        dof,
        time_s,
        step_s,
        force,
        coriolis,
        value,
        scale,
        state,
        channel,
        tuple(found),
        stiffness,
        _initial(value, scale, state),
    )


def _initial(value: Array, scale: Array, state: NDArray[np.int64]) -> Array:
    speed = (value / scale)[(state != POSITION) & np.isfinite(value)]
    place = value[state == POSITION][:1].sum()
    return np.array([speed[0], place, max(float(np.std(speed)), 1e-4) ** 2, FIRST_POSITION_STD**2])
