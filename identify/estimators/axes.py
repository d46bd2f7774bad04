"""Prepares a dive for the filter: for each degree of freedom its readings in time order, and the forces.

Coriolis forces couple the axes through products of velocities. They are formed from smoothed velocities, so that six
filters of one axis each replace a filter with twelve states. `coupled` forms them again from better velocities.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field, fields, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from bridge.arrays import Array
from bridge.errors import FitError
from bridge.vehicle.coefficients import COEFFICIENTS, DOFS, HEAVE, PITCH, ROLL, YAW
from bridge.vehicle.config import Vehicle, VehicleFile
from identify.dive import STAMPED_S, Dive, Signal
from identify.estimators.afloat import under_water
from identify.estimators.events import Events, events_of, loud_and_quiet
from identify.estimators.innovations import POSITION
from identify.estimators.lateness import (
    LATER_S,
    FilteredForce,
    Timing,
    behind_filter,
    by_lateness,
    means_behind_filter,
    timing_of,
)
from identify.estimators.motion import NO_MOTION, Motion
from identify.estimators.readings import (
    at_origin,
    channels,
    poses_of,
    restoring_force,
    stiffness_of,
    tumbles,
    with_rates_of_poses,
)
from identify.forces import obeyed_after_s, wrench
from identify.ingest.rotation import attitude_at
from identify.threads import side_by_side
from identify.wrench_history import WrenchHistory

GRID_S = 0.02


LEAST_START_S, LAGS_FORGOTTEN = 0.5, 10.0
"""The thrusters' state before the first command is unknown; after this many lags it no longer matters."""


LATE_SHARE = 0.3
"""Standard deviation of the time at which slowly sampled commands act, as a share of the sample interval."""

BRACKETS, SMALLEST_SPEED = 12, 1e-3
"""Number of speed brackets, and smallest width of all together, m/s or rad/s. Within a bracket the slope of quadratic
drag counts as constant."""

STRANGE_SHARE, TELLING_SHARE, FEWEST_TELLING = 0.2, 0.15, 20
"""A thrust curve is usually known to 10 %. A median difference of twice that between PWM and TAU_CMD means another
vehicle. A wrench below TELLING_SHARE of a thruster's limit (N, or N m) may lie in the dead band, so only larger
wrenches are compared, if there are at least FEWEST_TELLING."""

MOST_MADE_UP = 2.0
"""While the feed-forward is applied, the vehicle asks more of its thrusters than TAU_CMD, by the thrust that they were
found to lose: up to this multiple is no sign of another vehicle."""

LEAST_DRIVE = 1e-3
"""Thrust in an axis below this share of one thruster's limit (N, or N m) counts as none."""

LEAST_ANSWER = 1e-3
"""Share of that below which thrust is rounding, and answers to no motion."""


@dataclass(frozen=True)
class Brackets:
    """Brackets of an axis's speed, within which the slope of its square counts as constant.

    slopes (k,): derivative of speed times its magnitude, in the middle of each bracket. slope (n,): the slope of each
    event's bracket. step (n,): the row for this event in a table of all distinct steps in all brackets; without a step
    as in the axis. about (2, n): force of a unit of quadratic damping at the events in addition to a linear damping of
    that slope, first without the drag of the axis's own speed, then with it.
    """

    slopes: Array
    slope: Array
    step: NDArray[np.int64]
    about: Array


@dataclass(frozen=True)
class Axis(Events):
    """One degree of freedom: its events, and the forces in the steps between them.

    force (n, 2): thrust less restoring force in the first and the second half of the step before the event.
    coriolis (n, 6): force per unit of each total mass.
    stiffness: restoring moment per angle, for roll and pitch.
    speed (n,): the axis's own speed over each step; before_filter (n,): the same before an autopilot's smoothing, whose
    square gives the quadratic drag. quadratic: quadratic damping that is known beforehand.
    white_force: force that the log hides of the commands, N (N m) per root of 1/s; 0 if it hides nothing.
    timing: timing errors of the readings of an autopilot's own filter, of slow samples of the commands, and of stamps.
    trim_of_run: number of the trim force of each run, from 0; each has its own, unless all have one in common.
    smoothing_s: time constant of that filter. sampled_s: interval of the command samples, 0 if the commands are known
    at all times. stepped (n,): change of the force if slow samples step halfway to the next instead of going straight
    to it; None without such samples.
    """

    force: Array
    coriolis: Array
    stiffness: float
    speed: Array
    before_filter: Array
    quadratic: float = 0.0
    white_force: float = 0.0
    timing: tuple[Timing, ...] = ()
    smoothing_s: float = 0.0
    sampled_s: float = 0.0
    stepped: Array | None = None
    trim_of_run: tuple[int, ...] = (0,)

    @cached_property
    def coupled_dofs(self) -> frozenset[int]:
        """Degrees of freedom whose masses act in this one by Coriolis forces."""
        return frozenset(np.flatnonzero(self.coriolis.any(axis=0)).tolist())

    @cached_property
    def brackets(self) -> Brackets:
        return self._bracketed(BRACKETS, 2.0)

    @cached_property
    def one_bracket(self) -> Brackets:
        """A single bracket with slope zero, for linear damping."""
        return self._bracketed(1, 0.0)

    def thrust_over(self, other: "Axis") -> Array:
        """Mean force (n,) of this axis over each step of another."""
        impulse = np.cumsum(self.force.mean(axis=1) * self.step_s)
        gained = np.diff(np.interp(other.time_s, self.time_s, impulse), prepend=0.0)
        some = other.step_s > 0
        return np.asarray(np.where(some, gained / np.where(some, other.step_s, 1.0), 0.0))

    def _bracketed(self, count: int, slope_by_speed: float) -> Brackets:
        size = np.abs(self.speed)
        width = max(float(np.max(size)), SMALLEST_SPEED) / count
        slopes = np.asarray(slope_by_speed * width * (np.arange(count) + 0.5), dtype=np.float64)
        bracket = np.minimum(size / width, count - 1).astype(np.int64)
        slope = np.asarray(slopes[bracket], dtype=np.float64)
        step = np.where(self.step < 0, self.step, self.step * count + bracket)
        braked = slope * self.speed
        return Brackets(slopes, slope, step, np.stack([braked, braked - self.squared]))

    @cached_property
    def squared(self) -> Array:
        """Speed times its magnitude (n,) over each step, as the readings show it: a fast hull's drag is over before an
        autopilot's filter shows the speed that made it."""
        values = np.asarray(self.before_filter * np.abs(self.before_filter))
        if self.smoothing_s <= 0:
            return values
        return np.concatenate(
            [means_behind_filter(values[run], self.step_s[run], self.smoothing_s) for run in self.runs]
        )

    @property
    def stamped_s(self) -> float:
        """Standard error of the time at which thrust acts, as far as stamps tell it."""
        return self.timing[0].spread if self.timing and not self.is_coloured else STAMPED_S

    @property
    def trims(self) -> int:
        """Number of trim forces."""
        return max(self.trim_of_run) + 1

    def by_lateness(self, lag_s: float = LATER_S) -> Array:
        """Change of the force of each step (n,), per second that it comes later (`lateness.by_lateness`)."""
        return np.concatenate(
            [by_lateness(self.force[run], 0.5 * self.step_s[run], lag_s) for run in self.runs]
        )

    @property
    def shown_s(self) -> Array:
        """Times (n,) of the motion that an autopilot's filter shows at the events, on average."""
        return np.asarray(self.time_s - self.smoothing_s)


@dataclass(frozen=True)
class Axes:
    """The axes that a dive has information on, the reasons why other axes are missing, and notes on the forces.

    motion: the velocities that the Coriolis forces were made of. restoring: restoring force by degree of freedom,
    (m,) at the times of the motion, without the part that the stiffness makes of an axis's own integral. strange: why
    the recording can hardly be of this vehicle in this configuration; empty if it can. unpushed: the axes that no
    thruster pushed, each with a sentence; only the other axes' forces and the righting moment moved them, if anything
    did.
    """

    axes: tuple[Axis, ...]
    missing: dict[int, str]
    notes: tuple[str, ...]
    strange: str = ""
    motion: Motion = NO_MOTION
    restoring: dict[int, Array] = field(default_factory=dict)
    unpushed: dict[int, str] = field(default_factory=dict)

    @property
    def pushed(self) -> tuple[int, ...]:
        """The axes that thrust moved."""
        return tuple(axis.dof for axis in self.axes if axis.dof not in self.unpushed)

    def with_common_trims(self) -> "Axes":
        """The same axes, with a trim force that all runs have in common."""
        common = (replace(axis, trim_of_run=(0,) * len(axis.runs)) for axis in self.axes)
        return replace(self, axes=tuple(common))

    @property
    def rest_on_righting(self) -> tuple[str, ...]:
        """The coefficients of roll and pitch if no thruster pushed there: the righting moment sets their scale."""
        return tuple(c.name for c in COEFFICIENTS if c.dof in (ROLL, PITCH) and c.dof in self.unpushed)


def build_axes(
    dive: Dive, file: VehicleFile, configuration_name: str, dofs: Sequence[int] = range(6)
) -> Axes:
    """Return the axes, among these degrees of freedom, for which this dive has readings and forces.

    Raises FitError if the dive holds no thruster command at all, or if all its readings are frozen.
    """
    if dive.frozen and dive.velocity is dive.gyro is dive.fog is None:
        raise FitError(
            "every velocity and rate of turn in it repeats one value while the thrusters push: nothing "
            "can be identified; check the sensors, and what passes their readings on",
            of=dive.name,
        )
    vehicle = file.vehicle
    configuration = vehicle.configurations[configuration_name]
    lever = (0.0, 0.0, 0.0) if vehicle.sensors.dvl is None else vehicle.sensors.dvl.mounting.position_m
    forces = wrench(dive, file, configuration_name)
    later_s = max(LAGS_FORGOTTEN * forces.lag_s, LEAST_START_S)
    least_n = LEAST_DRIVE * configuration.thruster_limit_n
    begun_s = [(first_s + later_s, last_s) for first_s, last_s in forces.spans_s]
    spans_s, floats = under_water(begun_s, forces, dive.depth_by(vehicle.water), least_n)
    start, end = spans_s[0][0], spans_s[-1][1]
    grid = np.arange(start, max(end, start + 10 * GRID_S) + 2 * GRID_S, GRID_S)
    attitude = None if dive.attitude is None else attitude_at(dive.attitude, grid)
    velocity, motion = at_origin(dive, grid, np.asarray(lever))
    motion = with_rates_of_poses(dive, file, motion)
    poses = poses_of(dive, file, motion, attitude)
    unpushed = {
        dof: _unpushed(dof, float(np.max(np.abs(forces.asked[:, dof]), initial=0.0)) > least_n)
        for dof in dofs
        if np.std(forces.asked[:, dof]) <= least_n
    }

    def axis_of(dof: int) -> tuple[Axis, Array] | str:
        """An axis with its restoring force along the motion; why it is missing, if it is."""
        pose = poses.get(dof)
        read = channels(dive, dof, velocity, None if pose is None else pose.reading)
        if not read:
            return _unread(dive, dof)
        if dof in unpushed and read[0].state_read == POSITION and not forces.asked[:, dof].any():
            return f"{unpushed[dof]}, and {read[0].name} alone was read there"
        if dof in unpushed and forces.sampled_s and np.ptp(forces.asked[:, dof]) > LEAST_ANSWER * least_n:
            # Thrust that answers to the turning brakes it, and samples of it look like noise.
            return (
                f"hardly any thrust went into {DOFS[dof]}, as where an autopilot holds it, and commands that are known "
                f"every {forces.sampled_s:.2g} s hide its answers; push there, or record commands at 20 Hz or more"
            )
        events = events_of(dof, read, spans_s)
        if events is None:
            return f"{DOFS[dof]} was recorded only while no thruster command was"
        if forces.sampled_s:
            events = loud_and_quiet(events, forces.along(dof))
        stiffness = stiffness_of(dive, configuration, dof)
        held = restoring_force(configuration, dof, motion, attitude, pose, stiffness)
        if events.is_coloured:
            smoothing_s = dive.velocity_smoothing_s
            force, timing = _force_behind_filter(events, forces, grid, held, smoothing_s)
        else:
            smoothing_s, timing = 0.0, ()
            force = _force(events, forces, motion, held)
        coriolis, speed, before_filter = _coupling(events, motion, smoothing_s)
        axis = Axis(
            **{part.name: getattr(events, part.name) for part in fields(Events)},
            force=force,
            coriolis=coriolis,
            stiffness=stiffness,
            speed=speed,
            before_filter=before_filter,
            white_force=float(forces.hidden[dof]),
            timing=timing,
            smoothing_s=smoothing_s,
            trim_of_run=tuple(range(len(events.runs))),
        )
        if forces.sampled_s:
            axis = replace(
                _late_or_early(axis, forces, LATE_SHARE * forces.sampled_s),
                sampled_s=forces.sampled_s,
                stepped=_stepped(events, forces, grid, smoothing_s),
            )
        elif dive.stamped_s > STAMPED_S and not axis.is_coloured and dof not in unpushed:
            axis = _late_or_early(axis, forces, dive.stamped_s)
        if np.isfinite(axis.force).all() and np.isfinite(axis.coriolis).all():
            return axis, held
        return (
            f"the forces in {DOFS[dof]} are not finite: a thruster command, an attitude or a velocity is NaN"
        )

    every = dict(zip(dofs, side_by_side(axis_of, dofs), strict=True))
    return Axes(
        tuple(item[0] for item in every.values() if not isinstance(item, str)),
        {dof: why for dof, why in every.items() if isinstance(why, str)},
        (*forces.notes, *floats),
        _strange(dive, forces, vehicle, configuration_name),
        motion,
        {dof: item[1] for dof, item in every.items() if not isinstance(item, str)},
        unpushed,
    )


def _unpushed(dof: int, steadily: bool) -> str:
    if steadily:
        return f"the thrust in {DOFS[dof]} was constant throughout"
    righted = ", its righting moment alone did" if dof in (ROLL, PITCH) else ""
    return f"the thrusters never pushed in {DOFS[dof]}{righted}"


def _unread(dive: Dive, dof: int) -> str:
    """Why a dive has no readings of an axis, and what to record."""
    motion = f"{'velocity' if dof < 3 else 'rate of turn'} in {DOFS[dof]}"
    sensor = "DVL" if dof < 3 else "gyro"
    if ("velocity" if dof < 3 else "gyro") in dive.frozen:
        return (
            f"the recorded {motion} stands still at one value while the vehicle goes on; check the {sensor}, and what "
            "passes its readings on"
        )
    pose = {2: dive.depth if dive.depth is not None else dive.pressure}.get(dof, dive.attitude)
    source = "depth" if dof == HEAVE else "attitude"
    if dof == HEAVE and pose is not None and tumbles(dive):
        return f"no {motion} was recorded, and the depth of a vehicle that turns over tells none; record the {sensor}"
    limits = "" if dof < 2 or pose is None else f", and {source} alone does not determine it"
    return f"no {motion} was recorded{limits}; record the {sensor}"


def _strange(dive: Dive, forces: WrenchHistory, vehicle: Vehicle, configuration_name: str) -> str:
    recorded = dive.configuration_index()
    if recorded is not None and recorded != vehicle.veh_cfg(configuration_name):
        return (
            f"the recording says VEH_CFG {recorded}, configuration '{configuration_name}' of vehicle "
            f"'{vehicle.name}' is {vehicle.veh_cfg(configuration_name)}: it was dived in another configuration, or is "
            "another vehicle's"
        )
    shares = _off_the_command(dive, forces, vehicle.configurations[configuration_name].thruster_limit_n)
    worst = max(shares, key=lambda dof: shares[dof], default=0)
    if shares and shares[worst] > STRANGE_SHARE:
        return (
            f"in {DOFS[worst]} its thruster commands come to a wrench {shares[worst]:.0%} off the recorded TAU_CMD: "
            "the vehicle file's thrusters are not this vehicle's"
        )
    return ""


def _off_the_command(dive: Dive, forces: WrenchHistory, limit_n: float) -> dict[int, float]:
    """Median relative difference between the wrench from PWM and TAU_CMD, by horizontal axis, over commands that are
    large enough."""
    if forces.source != "pwm" or dive.tau_cmd is None:
        return {}
    from_pwm = Signal(forces.time_s, forces.asked)
    asked = from_pwm.held_at(dive.tau_cmd.time_s + obeyed_after_s(from_pwm, dive.tau_cmd))
    shares, makes_up = {}, dive.feedforward_acts
    for dof in (0, 1, YAW):
        commanded = dive.tau_cmd.value[:, dof]
        # Small thrust lies in the thrusters' dead band, so a small command says nothing about the geometry.
        telling = np.isfinite(asked[:, dof]) & (np.abs(commanded) > TELLING_SHARE * limit_n)
        if np.count_nonzero(telling) >= FEWEST_TELLING:
            times = asked[telling, dof] / commanded[telling]
            made_up = makes_up & (times >= 1.0) & (times <= MOST_MADE_UP)
            shares[dof] = float(np.median(np.where(made_up, 0.0, np.abs(times - 1.0))))
    return shares


def _force(events: Events, forces: WrenchHistory, motion: Motion, restoring_n: Array) -> Array:
    """Thrust less restoring force in the halves of each step, (n, 2)."""
    before = events.before_s
    force = forces.along(events.dof).halves_between(before, events.time_s)[:, :, 0]
    held = motion.mean_between(restoring_n, before, events.time_s)
    return np.asarray(force - held[:, None])


def _force_behind_filter(
    events: Events, forces: WrenchHistory, grid: Array, restoring_n: Array, smoothing_s: float
) -> tuple[Array, tuple[Timing, ...]]:
    """The force (n, 2) filtered like the readings of an autopilot's own filter, and their timing errors."""
    push = FilteredForce(grid, forces.along(events.dof).at(grid)[:, 0] - restoring_n)
    return _filtered(events, push, smoothing_s)


def _filtered(events: Events, push: FilteredForce, smoothing_s: float) -> tuple[Array, tuple[Timing, ...]]:
    before = events.before_s
    force = push.behind(smoothing_s).mean_between(before, events.time_s)
    timing = timing_of(push, smoothing_s, before, events.time_s, events.dof == HEAVE)
    return np.column_stack([force, force]), timing


def _stepped(events: Events, forces: WrenchHistory, grid: Array, smoothing_s: float) -> Array | None:
    """Change of the force of each step (n,), as the readings show it, if slow samples step halfway to the next."""
    if forces.stepped is None:
        return None
    straight, stepped = (history.along(events.dof) for history in (forces, forces.stepped))
    before = events.before_s
    if smoothing_s > 0:
        push = FilteredForce(grid, (stepped.at(grid) - straight.at(grid))[:, 0])
        return push.behind(smoothing_s).mean_between(before, events.time_s)
    both = (history.mean_between(before, events.time_s)[:, 0] for history in (stepped, straight))
    return np.subtract(*both)


def _late_or_early(axis: Axis, forces: WrenchHistory, spread_s: float) -> Axis:
    """Return the axis with a timing error of its commands of that standard deviation, in addition to any other."""
    before, apart_s = axis.before_s, 0.5 * spread_s / LATE_SHARE
    push = forces.along(axis.dof)
    early, late = (push.mean_between(before + by_s, axis.time_s + by_s)[:, 0] for by_s in (apart_s, -apart_s))
    timing: tuple[Timing, ...] = (Timing((late - early) / (2.0 * apart_s), spread_s),)
    if axis.timing:
        first, *others = axis.timing
        timing = (replace(first, spread=float(np.hypot(first.spread, spread_s))), *others)
    return replace(axis, timing=timing)


def axes_with_delay(built: Axes, forces: WrenchHistory, by_s: float) -> Axes:
    """Return the axes, which were built with these forces, for forces that act `by_s` later."""
    return replace(built, axes=tuple(axis_with_delay(axis, built, forces, by_s) for axis in built.axes))


def axis_with_delay(axis: Axis, built: Axes, forces: WrenchHistory, by_s: float) -> Axis:
    """Return an axis of `built`, which was built with these forces, for forces that act `by_s` later."""
    before, grid = axis.before_s, built.motion.time_s
    forces = forces.along(axis.dof)
    if not axis.is_coloured:
        moved = forces.halves_between(before - by_s, axis.time_s - by_s) - forces.halves_between(
            before, axis.time_s
        )
        return replace(axis, force=axis.force + moved[:, :, 0])
    push = FilteredForce(grid, forces.at(grid - by_s)[:, 0] - built.restoring[axis.dof])
    force, timing = _filtered(axis, push, axis.smoothing_s)
    return replace(axis, force=force, timing=(*timing, *axis.timing[len(timing) :]))


def coupled(axis: Axis, motion: Motion) -> Axis:
    """Return the axis with the Coriolis forces and its own speed from a motion: means over each step, filtered like
    its readings."""
    coriolis, speed, before_filter = _coupling(axis, motion, axis.smoothing_s)
    return replace(axis, coriolis=coriolis, speed=speed, before_filter=before_filter)


def _coupling(events: Events, motion: Motion, smoothing_s: float) -> tuple[Array, Array, Array]:
    """Coriolis forces (n, 6), own speed (n,) and the speed before an autopilot's smoothing (n,), by a motion."""
    before = events.before_s

    def shown(values: Array) -> Array:
        step_s = float(motion.time_s[1] - motion.time_s[0])
        smooth = behind_filter(values[:, None], step_s, smoothing_s)[:, 0]
        return motion.mean_between(smooth, before, events.time_s)

    columns = [
        -shown(force) if force.any() else np.zeros(len(before)) for force in motion.coriolis[events.dof]
    ]
    nu = motion.nu[:, events.dof]
    return np.column_stack(columns), shown(nu), motion.mean_between(nu, before, events.time_s)
