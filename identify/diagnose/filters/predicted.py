"""Motion and course of a dive as the filters predict them from earlier readings alone.

Innovations are regressed on this motion. Velocities that are smoothed over the whole dive would not do, because they
depend on the innovations that they are to explain.
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from bridge.arrays import Array
from bridge.errors import FitError
from bridge.vehicle.coefficients import HEAVE
from bridge.vehicle.config import VehicleFile
from identify.dive import Dive, Signal
from identify.effects.course import Course, lagged, world_axes
from identify.estimators.axes.axis import Axis
from identify.estimators.axes.motion import Motion
from identify.estimators.likelihood.axis import DAMPING, MASS
from identify.estimators.likelihood.joint import JointLikelihood
from identify.estimators.timing.lateness import FilteredForce
from identify.ingest.commands import unknown_between
from identify.ingest.rotation import euler_angles, turned_on
from identify.threads import side_by_side
from identify.thrust.pwm_rounding import unrounded_thrusts
from identify.thrust.wrench import PULSES_IN, asked_thrusts, tells_thrusters, thrusts_between
from identify.thrust.wrench_history import evenly_between

LEVELLED_S = 0.5
"""Time over which the noise of roll and pitch is averaged: long against an attitude's interval, and too short for a
gyro's bias."""

LEAST_AVERAGED = 4
"""Fewest readings in that time: of less frequent ones each is believed, for the hull was pushed in between."""

STEEPEST_RAD = 1.2
"""Pitch beyond which roll and heading turn too fast for their rates to be carried."""

APART_S = 1e-4
"""Times closer than this count as equal, because readings' times are rounded."""


@dataclass(frozen=True)
class Predicted:
    """Velocities and accelerations that the filters predict from earlier readings: nu, nu_dot (n, 6) at uniform times
    (n,)."""

    time_s: Array
    nu: Array
    nu_dot: Array


def predicted(joint: JointLikelihood, theta: Array, motion: Motion) -> Predicted:
    """Predict at the times of a motion, which provides the axes that are not fitted."""
    nu, nu_dot = motion.nu.copy(), np.gradient(motion.nu, motion.time_s, axis=0)
    step_s = float(motion.time_s[1] - motion.time_s[0])
    problems = joint.at(theta)

    def along(k: int) -> None:
        problem, theta_axis = problems[k], theta[joint.slices[k]]
        dof = problem.axis.dof
        state = problem.means(theta_axis)
        time_s = problem.axis.time_s
        last = np.maximum(np.searchsorted(time_s, motion.time_s - APART_S, side="left") - 1, 0)
        force = problem.mean_force(theta_axis).mean(axis=1)
        step = _last_step(problem.axis, motion.time_s)
        force_now, mass = force[step], np.exp(theta_axis[MASS])
        quadratic = problem.axis.quadratic + problem.quadratic(theta_axis)
        damping = np.exp(theta_axis[DAMPING]) + quadratic * problem.slope[step]
        speed, place_, disturbance = state[last].T
        rate = (force_now - damping * speed - problem.axis.stiffness * place_ + disturbance) / mass
        since = np.clip(motion.time_s - time_s[last], 0.0, 5 * step_s)
        nu[:, dof], nu_dot[:, dof] = speed + rate * since, rate

    side_by_side(along, range(len(problems)))
    return Predicted(motion.time_s, np.asfortranarray(nu), np.asfortranarray(nu_dot))


def _last_step(axis: Axis, at_s: Array) -> NDArray[np.intp]:
    """The last step of an axis (m,) that has ended by each time; the first step before its end."""
    just_before = at_s - APART_S
    step = np.minimum(np.searchsorted(axis.time_s, just_before, side="left"), len(axis.time_s) - 1)
    # A step that ends later may hold a command that responds to a reading at this time.
    step = np.where(axis.time_s[step] <= at_s + APART_S, step, np.maximum(step - 1, 0))
    # Of several readings at one time only the first ends a step of nonzero length.
    lasting = np.maximum.accumulate(np.where(axis.step_s > 0, np.arange(len(axis.time_s)), 0))
    return np.asarray(lasting[step])


def by_present_thrust(course: Course, joint: JointLikelihood) -> Course:
    """The predicted course with the accelerations due to the thrust of each instant.

    `predicted` takes the mean force of the step before, which is late by up to a step and a half. A controller that
    answers noisy readings makes thrust so quick that a late acceleration loses most of what it tells, and thrusters
    that sit elsewhere would pass for a centre of mass that does.
    """
    thrust, nu_dot = course.wrench_of(course.thrust_n), course.nu_dot.copy(order="F")

    def along(axis: Axis) -> None:
        pushed = FilteredForce(course.time_s, thrust[:, axis.dof]).behind(axis.smoothing_s)
        step = _last_step(axis, course.time_s)
        late = pushed.mean_between(axis.time_s[step] - axis.step_s[step], axis.time_s[step])
        nu_dot[:, axis.dof] += (pushed.force - late) / course.mass[axis.dof]

    side_by_side(along, [problem.axis for problem in joint.problems])
    return replace(course, nu_dot=nu_dot)


def course_of(
    dive: Dive, file: VehicleFile, configuration_name: str, at: Predicted, mass: Array, damping: Array
) -> Course:
    """The course of the predicted motion; without thrusters if the pulses of each are not recorded.

    mass, damping (6,): of the nominal model.
    """
    configuration = file.vehicle.configurations[configuration_name]
    time_s, asked = at.time_s, _asked(dive, file, configuration_name)
    count = asked.value.shape[1]
    by_wrench = not tells_thrusters(dive, configuration)
    euler = euler_ahead(dive.attitude, at, dive.breaks_s)
    # Depth grows and altitude shrinks with the heave velocity, nearly.
    depth, altitude = dive.depth_by(file.vehicle.water), dive.altitude
    return Course(
        configuration,
        time_s,
        at.nu,
        at.nu_dot,
        euler,
        reading_ahead(depth, time_s, at.nu[:, HEAVE], dive.breaks_s),
        reading_ahead(altitude, time_s, -at.nu[:, HEAVE], dive.breaks_s),
        position(Motion(time_s, at.nu), euler, dive.breaks_s),
        _mean_ahead(asked, time_s),
        np.full((len(time_s), count), np.nan)
        if by_wrench or dive.rpm is None
        else dive.rpm.at(time_s)[:, :count],
        _at(dive.voltage, time_s),
        file.vehicle.thrust_curve.lag_s,
        mass,
        damping,
        by_wrench=by_wrench,
    )


def _asked(dive: Dive, file: VehicleFile, configuration_name: str) -> Signal:
    """Thrust (n, k) that each thruster is asked for; the wrench (n, 6) if the pulses of each are not recorded."""
    configuration = file.vehicle.configurations[configuration_name]
    if tells_thrusters(dive, configuration):
        asked = asked_thrusts(dive, file, configuration_name)
        if unknown_between(dive, asked):
            return thrusts_between(dive, file, configuration_name)
        return unrounded_thrusts(asked, dive, file, configuration_name)
    elif dive.tau_cmd is not None and len(dive.tau_cmd):
        asked = dive.tau_cmd
    else:
        raise FitError(
            f"neither pulses for the {len(configuration.thrusters)} thrusters nor a wrench are recorded; record "
            f"the pulses ({PULSES_IN})",
            of=dive.name,
        )
    return evenly_between(asked) if unknown_between(dive, asked) else asked


def _mean_ahead(held: Signal, time_s: Array) -> Array:
    """Mean (n, k) of a zero-order hold over the step after each time."""
    steps = np.diff(held.time_s)[:, None] * held.value[:-1]
    total = np.vstack([np.zeros((1, held.value.shape[1])), np.cumsum(steps, axis=0)])
    ends = np.append(time_s, 2 * time_s[-1] - time_s[-2])
    area = np.column_stack([np.interp(ends, held.time_s, column) for column in total.T])
    return np.asarray(np.diff(area, axis=0) / np.diff(ends)[:, None])


def _at(signal: Signal | None, time_s: Array) -> Array:
    return np.full(len(time_s), np.nan) if signal is None or not len(signal) else signal.at(time_s)[:, 0]


def reading_ahead(signal: Signal | None, time_s: Array, rate: Array, breaks_s: Array) -> Array:
    """A reading (n,) at uniform times, from the last one before each and the integral of its predicted `rate` (n,)."""
    if signal is None or not (good := np.isfinite(signal.value[:, 0])).any():
        return np.full(len(time_s), np.nan)
    last = _last_before(signal.time_s[good], time_s, breaks_s)
    return np.asarray(
        signal.value[good, 0][last] + _since(signal.time_s[good][last], time_s, rate[:, None])[:, 0]
    )


def euler_ahead(attitude: Signal | None, at: Predicted, breaks_s: Array) -> Array:
    """Roll and heading, continuous over full turns, and pitch, (n, 3); zeros without an attitude.

    From the last attitude before each time and the predicted turn since: an attitude between two readings knows the
    disturbance that turned the hull between them. Of frequent readings, roll and pitch are averaged over LEVELLED_S:
    their noise would show a level current as a jitter in heave, where a depth sensor reads tenths of a millimetre.
    """
    if attitude is None or not len(attitude):
        return np.zeros((len(at.time_s), 3))
    last = _last_before(attitude.time_s, at.time_s, breaks_s)
    turn = _since(attitude.time_s[last], at.time_s, at.nu[:, 3:])
    roll, pitch, heading = euler_angles(turned_on(attitude.value[last], turn))
    euler = np.column_stack([np.unwrap(roll), pitch, np.unwrap(heading)])
    seldom = np.median(np.diff(attitude.time_s)) > LEVELLED_S / LEAST_AVERAGED if len(attitude) > 1 else True
    return euler if seldom or np.abs(pitch).max() > STEEPEST_RAD else _levelled(euler, at, breaks_s)


def _levelled(euler: Array, at: Predicted, breaks_s: Array) -> Array:
    """Roll, pitch and heading with roll and pitch averaged over the last LEVELLED_S, in which the rates carry them."""
    p, q, r = at.nu[:, 3:].T
    sin_r, cos_r, tan_p = np.sin(euler[:, 0]), np.cos(euler[:, 0]), np.tan(euler[:, 1])
    # Fossen 2011, eq. 2.26.
    rates = p + (q * sin_r + r * cos_r) * tan_p, q * cos_r - r * sin_r
    motion = Motion(at.time_s, at.nu)
    carried = np.column_stack([motion.integral(rate) for rate in rates])
    step_s = float(at.time_s[1] - at.time_s[0])
    runs = np.split(euler[:, :2] - carried, np.searchsorted(at.time_s, breaks_s))
    tilt = np.concatenate([lagged(run, step_s, LEVELLED_S) for run in runs if len(run)])
    return np.column_stack([tilt + carried, euler[:, 2]])


def _last_before(read_s: Array, time_s: Array, breaks_s: Array) -> NDArray[np.intp]:
    """Index (n,) of the last reading before each time; of its run's first for a time before all readings."""
    last = np.maximum(np.searchsorted(read_s, time_s - APART_S, side="left") - 1, 0)
    of_earlier_run = np.searchsorted(breaks_s, read_s[last]) < np.searchsorted(breaks_s, time_s)
    return np.asarray(np.minimum(last + of_earlier_run, len(read_s) - 1))


def _since(start_s: Array, time_s: Array, rate: Array) -> Array:
    """Integrals (n, k) of rates (n, k) at uniform times (n,), up to each of these; 0 before the start."""
    motion = Motion(time_s, rate)
    total = np.column_stack([motion.integral(column) for column in rate.T])
    begun = np.column_stack([np.interp(start_s, time_s, column) for column in total.T])
    return np.asarray((total - begun) * (start_s < time_s)[:, None])


def position(motion: Motion, euler: Array, breaks_s: Array) -> Array:
    """North and east (n, 2) by dead reckoning from the beginning of each run.

    Heave takes a tilted hull along: one that pitches as it is driven up and down went 0.1 m so.
    """
    level = world_axes(euler)[:2]
    way = np.column_stack([motion.integral((axis * motion.nu[:, :3]).sum(axis=1)) for axis in level])
    runs = np.split(way, np.searchsorted(motion.time_s, breaks_s))
    return np.vstack([run - run[:1] for run in runs])
