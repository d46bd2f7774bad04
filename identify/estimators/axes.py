"""From a dive to what the filter eats: for each degree of freedom its readings in time order, and the forces.

Coriolis forces couple the axes through products of velocities; they are formed from smoothed velocities, which
leaves six filters of one axis each instead of one of twelve states. `coupled` makes them anew from better ones.
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from bridge.vehicle.coefficients import DOFS
from bridge.vehicle.config import GRAVITY_M_S2, Configuration, Vehicle, VehicleFile
from bridge.vehicle.dynamics import coriolis as _coriolis
from bridge.vehicle.dynamics import restoring
from identify.dive import Dive, Signal
from identify.estimators.innovations import INCREMENT, POSITION, VELOCITY
from identify.estimators.readings import FEWEST, HEAVE, PITCH, ROLL, Channel, channels
from identify.estimators.smoothing import smoothed_velocity
from identify.forces import WrenchHistory, wrench
from identify.ingest.rotation import attitude_at

Array = NDArray[np.float64]

GRID_S = 0.02
LONGEST_STEP_S = 0.05
"""Longer steps between readings are divided, so that what is held over a step is not held for long."""

TIME_DIGITS = 5
"""Times are rounded to 10 us, by which no vehicle moves: then few steps differ, and each is worked out once."""

FIRST_POSITION_STD = 0.1
LEAST_START_S = 0.5
LEAST_COMMANDS_HZ = 4.0
STRANGE_SHARE, TELLING_SHARE = 0.5, 0.15
LEAST_DRIVE = 1e-3
"""Thrust in an axis below this share of one thruster's limit (N, or N m) weighs nothing."""


@dataclass(frozen=True)
class Axis:
    """One degree of freedom, (n,) events in time order.

    step_s: since the event before; it is the one of `different_s` that `step` names, or 0 where that is -1.
    force (n, 2): thrust less restoring in the first and the second half of the step before the event.
    coriolis (n, 6): force for each unit of each total mass. reading: NaN where the event only divides a step.
    scale: standard deviation of a reading over its channel's noise. channel: which of `channels` was read.
    stiffness: restoring moment by angle, for roll and pitch. initial (4,): first speed and angle or depth, and
    their variances.
    """

    dof: int
    time_s: Array
    step_s: Array
    different_s: Array
    step: NDArray[np.int64]
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
class Motion:
    """Velocities `nu` (m, 6) at the uniform times `time_s` (m,), as smooth as they are believed to be."""

    time_s: Array
    nu: Array

    def integral(self, values: Array) -> Array:
        """Of what is given at the times, (m,), by the trapezium rule."""
        steps = 0.5 * (values[1:] + values[:-1]) * np.diff(self.time_s)
        return np.concatenate([[0.0], np.cumsum(steps)])

    def mean_between(self, values: Array, start_s: Array, end_s: Array) -> Array:
        """(n,) of what is given at the times, (m,), over each interval; 0 where that is empty."""
        total = self.integral(values)
        span_s = end_s - start_s
        area = np.interp(end_s, self.time_s, total) - np.interp(start_s, self.time_s, total)
        return np.asarray(np.where(span_s > 0, area / np.where(span_s > 0, span_s, 1.0), 0.0))


NO_MOTION = Motion(np.zeros(0), np.zeros((0, 6)))


@dataclass(frozen=True)
class Axes:
    """The axes that a dive says something of, why it says nothing of the others, and notes on the forces.

    motion: the velocities that the Coriolis forces were made of. strange: why the recording can hardly be one of
    this vehicle in this configuration, empty where it can.
    """

    axes: tuple[Axis, ...]
    missing: dict[int, str]
    notes: tuple[str, ...]
    strange: str = ""
    motion: Motion = NO_MOTION


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
    grid = np.arange(start, max(end, start + 10 * GRID_S) + 2 * GRID_S, GRID_S)
    motion = Motion(grid, smoothed_velocity(dive, grid))
    attitude = None if dive.attitude is None else attitude_at(dive.attitude, grid)
    lever = (0.0, 0.0, 0.0) if vehicle.sensors.dvl is None else vehicle.sensors.dvl.mounting.position_m
    velocity = _at_origin(dive.velocity, motion, np.asarray(lever))
    places = _places(dive, file, motion, attitude)
    axes, missing = [], {}
    for dof in range(6):
        place = places.get(dof)
        found = channels(dive, dof, velocity, None if place is None else place.reading)
        if not found:
            missing[dof] = f"no {'velocity' if dof < 3 else 'rate of turn'} in {DOFS[dof]} was recorded"
        elif np.std(forces.asked[:, dof]) <= LEAST_DRIVE * configuration.thruster_limit_n:
            missing[dof] = f"the thrusters never pushed in {DOFS[dof]}: there is no force to weigh it by"
        elif (events := _events(dof, found, (start, end))) is None:
            missing[dof] = f"{DOFS[dof]} was recorded only while no thruster command was"
        else:
            restoring_n = _restoring(configuration, dof, motion, attitude, place)
            axes.append(coupled(_pushed(events, configuration, forces, motion, restoring_n), motion))
    return Axes(tuple(axes), missing, forces.notes, _strange(dive, forces, vehicle, name), motion)


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


def _at_origin(velocity: Signal | None, motion: Motion, lever: Array) -> Signal | None:
    """Velocity (n, 3) at the body's origin, from that at the DVL's transducer `lever` away."""
    if velocity is None or not lever.any():
        return velocity
    by_turning = np.cross(motion.nu[:, 3:], lever)
    carried = np.column_stack([np.interp(velocity.time_s, motion.time_s, column) for column in by_turning.T])
    return Signal(velocity.time_s, velocity.value - carried)


@dataclass(frozen=True)
class Place:
    """The integral of one axis's own velocity: what was read, (n, 1), less what the other axes added to it.

    `carried` (m,) is that addition at the times of the motion.
    """

    reading: Signal
    carried: Array


def _places(dive: Dive, file: VehicleFile, motion: Motion, attitude: Array | None) -> dict[int, Place]:
    """Depth, roll and pitch by degree of freedom, as far as they are recorded (Fossen 2011, eqs 2.18 and 2.26)."""
    depth = dive.depth_by(file.vehicle.water)
    found: dict[int, tuple[Signal, Array]] = {}
    still = np.zeros(len(motion.time_s))
    if attitude is None or dive.attitude is None:
        if depth is not None:
            found[HEAVE] = depth, still
    else:
        u, v, w, _, q, r = motion.nu.T
        down_x, down_y, down_z = down_axis(attitude)
        if depth is not None:
            found[HEAVE] = depth, down_x * u + down_y * v + (down_z - 1.0) * w
        roll, pitch = np.arctan2(down_y, down_z), np.arcsin(np.clip(-down_x, -1.0, 1.0))
        x, y, z = down_axis(dive.attitude.value)
        turned = q * np.sin(roll) + r * np.cos(roll)
        found[ROLL] = Signal(dive.attitude.time_s, np.arctan2(y, z)[:, None]), turned * np.tan(pitch)
        level = q * (np.cos(roll) - 1.0) - r * np.sin(roll)
        found[PITCH] = Signal(dive.attitude.time_s, np.arcsin(np.clip(-x, -1.0, 1.0))[:, None]), level
    out = {}
    for dof, (read, rate) in found.items():
        carried = motion.integral(rate)
        at = np.interp(read.time_s, motion.time_s, carried)
        out[dof] = Place(Signal(read.time_s, read.value - at[:, None]), carried)
    return out


def down_axis(attitude: Array) -> tuple[Array, Array, Array]:
    """The earth's down axis in body axes, from attitudes (n, 4)."""
    w, x, y, z = attitude.T
    return 2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)


def _restoring(
    configuration: Configuration, dof: int, motion: Motion, attitude: Array | None, place: Place | None
) -> Array:
    """The restoring force (m,) at the times of the motion; of roll and pitch what the stiffness does not make."""
    if attitude is None:
        return np.full(len(motion.time_s), configuration.net_buoyancy_n if dof == HEAVE else 0.0)
    g = np.asarray(restoring(configuration, tuple(attitude.T))[dof])
    if dof not in (ROLL, PITCH) or place is None:
        return g
    down_x, down_y, down_z = down_axis(attitude)
    angle = np.arctan2(down_y, down_z) if dof == ROLL else np.arcsin(np.clip(-down_x, -1.0, 1.0))
    return g - _stiffness(configuration, dof) * (angle - place.carried)


def _stiffness(configuration: Configuration, dof: int) -> float:
    if dof not in (ROLL, PITCH):
        return 0.0
    return configuration.centre_of_gravity_below_buoyancy_m * configuration.dry_mass_kg * GRAVITY_M_S2


def _events(dof: int, found: list[Channel], span_s: tuple[float, float]) -> Axis | None:
    """The readings of an axis in time order, long steps divided, without any force yet."""
    time_s = np.round(np.concatenate([c.time_s for c in found]), TIME_DIGITS)
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
    initial = _initial(value, scale, state)
    between = np.round(_dividing(time_s), TIME_DIGITS).astype(np.float64)
    before = np.searchsorted(time_s, between)
    time_s = np.insert(time_s, before, between)
    step_s = np.round(np.diff(time_s, prepend=time_s[0]), TIME_DIGITS).astype(np.float64)
    found_s, step = np.unique(step_s, return_inverse=True)
    empty = int(found_s[0] == 0.0)
    return Axis(
        dof,
        time_s,
        step_s,
        np.asarray(found_s[empty:], dtype=np.float64),
        np.asarray(step - empty, dtype=np.int64),
        np.zeros((len(time_s), 2)),
        np.zeros((len(time_s), 6)),
        np.insert(value, before, np.nan),
        np.insert(scale, before, 1.0),
        np.insert(state, before, VELOCITY),
        np.insert(channel, before, 0),
        tuple(found),
        0.0,
        initial,
    )


def _dividing(time_s: Array) -> Array:
    """Times that divide every step longer than LONGEST_STEP_S into equal ones."""
    step_s = np.diff(time_s)
    pieces = np.ceil(step_s / LONGEST_STEP_S - 1e-6).astype(np.int64)
    extra = np.maximum(pieces - 1, 0)
    step = np.repeat(np.arange(len(step_s)), extra)
    count = np.arange(len(step)) - np.repeat(np.cumsum(extra) - extra, extra) + 1
    return np.asarray(time_s[step] + count * step_s[step] / pieces[step])


def _pushed(
    events: Axis, configuration: Configuration, forces: WrenchHistory, motion: Motion, restoring_n: Array
) -> Axis:
    """The events with the thrust less restoring of each step."""
    before = np.concatenate([events.time_s[:1], events.time_s[:-1]])
    force = forces.halves_between(before, events.time_s)[:, :, events.dof]
    held = motion.mean_between(restoring_n, before, events.time_s)
    stiffness = _stiffness(configuration, events.dof)
    return replace(events, force=force - held[:, None], stiffness=stiffness)


def coupled(axis: Axis, motion: Motion) -> Axis:
    """The axis with the Coriolis forces of a motion, each step's mean."""
    before = np.concatenate([axis.time_s[:1], axis.time_s[:-1]])
    columns = []
    # C(nu) nu is linear in the masses: what each contributes is what a mass of one alone would.
    for one in np.eye(6).tolist():
        force = np.asarray(_coriolis(one, tuple(motion.nu.T))[axis.dof])
        columns.append(
            -motion.mean_between(force, before, axis.time_s) if force.any() else np.zeros(len(before))
        )
    return replace(axis, coriolis=np.column_stack(columns))


def _initial(value: Array, scale: Array, state: NDArray[np.int64]) -> Array:
    speed = (value / scale)[(state != POSITION) & np.isfinite(value)]
    place = value[state == POSITION][:1].sum()
    return np.array([speed[0], place, max(float(np.std(speed)), 1e-4) ** 2, FIRST_POSITION_STD**2])
