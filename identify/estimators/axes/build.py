"""Prepares a dive for the filter: for each degree of freedom its readings in time order, and the forces."""

from collections.abc import Sequence
from dataclasses import fields, replace

import numpy as np

from bridge.arrays import Array
from bridge.errors import FitError
from bridge.vehicle.coefficients import DOFS, HEAVE, PITCH, ROLL
from bridge.vehicle.config import Configuration, VehicleFile
from bridge.vehicle.thrusters import thrust_curve
from identify.dive import STAMPED_S, Dive
from identify.estimators.axes.afloat import under_water
from identify.estimators.axes.another_vehicle import strange
from identify.estimators.axes.axis import Axes, Axis
from identify.estimators.axes.events import Events, events_of, loud_and_quiet
from identify.estimators.axes.forces import (
    LATE_SHARE,
    change_if_stepped,
    coupling,
    step_forces,
    step_forces_behind_filter,
    with_uncertain_stamps,
    with_uncertain_timing,
)
from identify.estimators.axes.readings import (
    at_origin,
    channels,
    poses_of,
    restoring_force,
    stiffness_of,
    tumbles,
    with_heave_of_depth,
    with_rates_of_poses,
)
from identify.estimators.filter.state import POSITION
from identify.ingest.rotation import attitude_at
from identify.threads import side_by_side
from identify.thrust.wrench import wrench

GRID_S = 0.02


LEAST_START_S, LAGS_FORGOTTEN = 0.5, 10.0
"""The thrusters' state before the first command is unknown; after this many lags it no longer matters."""

LEAST_DRIVE = 1e-3
"""Thrust in an axis below this share of the most that one thruster gives (N, or N m) counts as none."""

LEAST_ANSWER = 1e-3
"""Share of that below which thrust is rounding, and answers to no motion."""


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
    least_n = LEAST_DRIVE * _most_n(dive, file, configuration)
    begun_s = [(first_s + later_s, last_s) for first_s, last_s in forces.spans_s]
    spans_s, floats = under_water(begun_s, forces, dive.depth_by(vehicle.water), least_n)
    start, end = spans_s[0][0], spans_s[-1][1]
    grid = np.arange(start, max(end, start + 10 * GRID_S) + 2 * GRID_S, GRID_S)
    attitude = None if dive.attitude is None else attitude_at(dive.attitude, grid)
    velocity, motion = at_origin(dive, grid, np.asarray(lever))
    motion = with_rates_of_poses(dive, file, motion)
    poses = poses_of(dive, file, motion, attitude)
    if dive.velocity_is_filtered and HEAVE in poses:
        motion = with_heave_of_depth(motion, poses[HEAVE])
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
                f"every {forces.sampled_s:.2g} s hide its answers; push there, or record commands more often"
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
            force, timing = step_forces_behind_filter(events, forces, grid, held, smoothing_s)
        else:
            smoothing_s, timing = 0.0, ()
            force = step_forces(events, forces, motion, held)
        coriolis, speed, before_filter = coupling(events, motion, smoothing_s)
        axis = Axis(
            **{part.name: getattr(events, part.name) for part in fields(Events)},
            force=force,
            coriolis=coriolis,
            stiffness=stiffness,
            speed=speed,
            before_filter=before_filter,
            white_force=float(forces.hidden[dof]),
            unknown_s=float(forces.unknown_s[dof]),
            timing=timing,
            smoothing_s=smoothing_s,
            trim_of_run=tuple(range(len(events.runs))),
        )
        if forces.sampled_s:
            axis = replace(
                with_uncertain_timing(axis, forces, LATE_SHARE * forces.sampled_s),
                sampled_s=forces.sampled_s,
                stepped=change_if_stepped(events, forces, grid, smoothing_s),
            )
        elif dive.stamped_s > STAMPED_S and not axis.is_coloured and dof not in unpushed:
            axis = with_uncertain_stamps(axis, forces, dive.stamped_s)
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
        strange(dive, forces, vehicle, configuration_name),
        motion,
        {dof: item[1] for dof, item in every.items() if not isinstance(item, str)},
        unpushed,
    )


def _most_n(dive: Dive, file: VehicleFile, configuration: Configuration) -> float:
    """The most (N) that one thruster gives: its limit, and by pulses no more than their curve."""
    if dive.pwm is None:
        return configuration.thruster_limit_n
    curve = thrust_curve(file.vehicle.thrust_curve, file.path.parent)
    return min(configuration.thruster_limit_n, max(curve.max_n, -curve.min_n))


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
