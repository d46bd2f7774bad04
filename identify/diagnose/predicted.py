"""Velocities and accelerations predicted by the filters from earlier readings alone, and the course made of them.

A regressor of an innovation must not depend on it. A velocity smoothed over the whole dive does, and any force
computed from it would predict the innovations even without a gap.
"""

from dataclasses import dataclass

import numpy as np
from numba import njit
from numpy.typing import NDArray

from bridge.errors import FitError
from bridge.vehicle.config import VehicleFile
from bridge.vehicle.thrusters import NEUTRAL_US, thrust_curve
from identify.dive import Dive, Signal
from identify.effects.course import Course
from identify.estimators.likelihood_axis import DAMPING, MASS
from identify.estimators.likelihood_joint import JointLikelihood
from identify.estimators.motion import Motion
from identify.estimators.places import down_axis
from identify.forces import evenly_between, tells_thrusters, unrounded_thrusts
from identify.ingest.commands import sampled_slowly
from identify.ingest.rotation import attitude_at

Array = NDArray[np.float64]

APART_S = 1e-4
"""Times closer than this count as equal, because readings' times are rounded."""


@dataclass(frozen=True)
class Predicted:
    """nu, nu_dot (n, 6) at uniform times (n,), from earlier readings."""

    time_s: Array
    nu: Array
    nu_dot: Array


def predicted(joint: JointLikelihood, theta: Array, motion: Motion) -> Predicted:
    """Predict at the times of a motion, which provides the axes that are not fitted."""
    nu, nu_dot = motion.nu.copy(), np.gradient(motion.nu, motion.time_s, axis=0)
    step_s = float(motion.time_s[1] - motion.time_s[0])
    for problem, place in zip(joint.at(theta), joint.places, strict=True):
        theta_axis, dof = theta[place], problem.axis.dof
        state = problem.means(theta_axis)
        time_s = problem.axis.time_s
        just_before = motion.time_s - APART_S
        last = np.maximum(np.searchsorted(time_s, just_before, side="left") - 1, 0)
        # A step that ends later may hold a command that responds to a reading at this time.
        force = problem.mean_force(theta_axis).mean(axis=1)
        step = np.minimum(np.searchsorted(time_s, just_before, side="left"), len(time_s) - 1)
        step = np.where(time_s[step] <= motion.time_s + APART_S, step, np.maximum(step - 1, 0))
        # Of several readings at one time only the first ends a step of nonzero length.
        lasting = np.maximum.accumulate(np.where(problem.axis.step_s > 0, np.arange(len(time_s)), 0))
        step = lasting[step]
        force_now, mass = force[step], np.exp(theta_axis[MASS])
        quadratic = problem.axis.quadratic + problem.quadratic(theta_axis)
        damping = np.exp(theta_axis[DAMPING]) + quadratic * problem.slope[step]
        speed, place_, disturbance = state[last].T
        rate = (force_now - damping * speed - problem.axis.stiffness * place_ + disturbance) / mass
        since = np.clip(motion.time_s - time_s[last], 0.0, 5 * step_s)
        nu[:, dof], nu_dot[:, dof] = speed + rate * since, rate
    return Predicted(motion.time_s, np.asfortranarray(nu), np.asfortranarray(nu_dot))


def mean_before(time_s: Array, values: Array, start_s: Array, end_s: Array) -> Array:
    """Means (m,) over intervals of values at uniform times (n,); causal: no mean uses a value after its end.

    Beyond the last time, values are extrapolated from the two before, and the next interval corrects for that. 0 for
    an empty interval.
    """
    return means_before(time_s, values[:, None], start_s, end_s)[:, 0]


def means_before(time_s: Array, values: Array, start_s: Array, end_s: Array) -> Array:
    """The same means (m, k) for several columns (n, k)."""
    step_s = float(time_s[1] - time_s[0])
    values = np.ascontiguousarray(values, dtype=np.float64)
    return np.asarray(_mean_of_each(float(time_s[0]), step_s, values, start_s, end_s))


def value_before(time_s: Array, values: Array, at_s: Array) -> Array:
    """Values (m,), extrapolated from the last two of the uniform times (n,) that are not later."""
    step_s = time_s[1] - time_s[0]
    last = np.clip(((at_s - time_s[0]) / step_s + 1e-6).astype(np.intp), 1, len(time_s) - 1)
    since = np.clip((at_s - time_s[last]) / step_s, -1.0, 1.0)
    return np.asarray(values[last] + since * (values[last] - values[last - 1]))


@njit(cache=True, inline="always")
def _last(began_s: float, step_s: float, count: int, at_s: float) -> tuple[int, float]:
    """Index of the last time that is not later, at least 1, and the time since."""
    last = min(max(int((at_s - began_s) / step_s + 1e-6), 1), count - 1)
    return last, min(max(at_s - (began_s + last * step_s), -step_s), step_s)


@njit(cache=True, nogil=True)
def _mean_of_each(began_s: float, step_s: float, values: Array, start_s: Array, end_s: Array) -> Array:
    count, width = values.shape
    out = np.zeros((len(start_s), width))
    for k in range(len(start_s)):
        span_s = end_s[k] - start_s[k]
        if span_s > 0:
            i, early_s = _last(began_s, step_s, count, start_s[k])
            j, late_s = _last(began_s, step_s, count, end_s[k])
            by_i, by_j = 0.5 * early_s**2 / step_s, 0.5 * late_s**2 / step_s
            # Of the trapezoids between i and j, each end has half a step.
            ends_s = 0.5 * step_s if i < j else 0.0
            per_s = 1.0 / span_s
            before_i, at_i = by_i * per_s, (ends_s - early_s - by_i) * per_s
            before_j, at_j = -by_j * per_s, (ends_s + late_s + by_j) * per_s
            for c in range(width):
                out[k, c] = (
                    before_i * values[i - 1, c]
                    + at_i * values[i, c]
                    + at_j * values[j, c]
                    + before_j * values[j - 1, c]
                )
            for at in range(i + 1, j):
                for c in range(width):
                    out[k, c] += step_s * per_s * values[at, c]
    return out


def course_of(
    dive: Dive, file: VehicleFile, configuration: str, at: Predicted, mass: Array, damping: Array
) -> Course:
    """The course of the predicted motion; without thrusters if the pulses of each are not recorded.

    mass, damping (6,): of the nominal model.
    """
    shape = file.vehicle.configurations[configuration]
    time_s, asked = at.time_s, _asked(dive, file, configuration)
    count = asked.value.shape[1]
    by_wrench = not tells_thrusters(dive, shape)
    # One step earlier: an angle must not explain its own reading.
    euler = _euler(dive, time_s - (time_s[1] - time_s[0]))
    depth = dive.depth_by(file.vehicle.water)
    return Course(
        shape,
        time_s,
        at.nu,
        at.nu_dot,
        euler,
        _at(depth, time_s),
        _at(dive.altitude, time_s),
        _position(Motion(time_s, at.nu), euler),
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


def _asked(dive: Dive, file: VehicleFile, configuration: str) -> Signal:
    """Thrust (n, k) that each thruster is asked for; the wrench (n, 6) if the pulses of each are not recorded."""
    shape = file.vehicle.configurations[configuration]
    if dive.pwm is not None and tells_thrusters(dive, shape):
        pulses = dive.pwm.value[:, : len(shape.thrusters)]
        sent = np.where(pulses > 0, pulses, NEUTRAL_US)
        curve = thrust_curve(file.vehicle.thrust_curve, file.path.parent)
        asked = Signal(dive.pwm.time_s, curve.thrust(sent))
        if not sampled_slowly(asked):
            return unrounded_thrusts(asked, dive, file, configuration)
    elif dive.tau_cmd is not None and len(dive.tau_cmd):
        asked = dive.tau_cmd
    else:
        raise FitError(
            f"neither pulses for the {len(shape.thrusters)} thrusters nor a wrench are recorded; record "
            "ACTUATOR_OUTPUT_STATUS or SERVO_OUTPUT_RAW",
            of=dive.name,
        )
    return evenly_between(asked) if sampled_slowly(asked) else asked


def _mean_ahead(held: Signal, time_s: Array) -> Array:
    """Mean (n, k) of a zero-order hold over the step after each time."""
    steps = np.diff(held.time_s)[:, None] * held.value[:-1]
    total = np.vstack([np.zeros((1, held.value.shape[1])), np.cumsum(steps, axis=0)])
    ends = np.append(time_s, 2 * time_s[-1] - time_s[-2])
    area = np.column_stack([np.interp(ends, held.time_s, column) for column in total.T])
    return np.asarray(np.diff(area, axis=0) / np.diff(ends)[:, None])


def _at(signal: Signal | None, time_s: Array) -> Array:
    return np.full(len(time_s), np.nan) if signal is None or not len(signal) else signal.at(time_s)[:, 0]


def _euler(dive: Dive, time_s: Array) -> Array:
    """Roll and heading, continuous over full turns, and pitch, (n, 3); zeros without an attitude."""
    if dive.attitude is None or not len(dive.attitude):
        return np.zeros((len(time_s), 3))
    attitude = attitude_at(dive.attitude, time_s)
    down_x, down_y, down_z = down_axis(attitude)
    w, x, y, z = attitude.T
    heading = np.unwrap(np.arctan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z)))
    roll = np.unwrap(np.arctan2(down_y, down_z))
    return np.column_stack([roll, np.arcsin(np.clip(-down_x, -1.0, 1.0)), heading])


def _position(motion: Motion, euler: Array) -> Array:
    """North and east (n, 2) by dead reckoning from the beginning."""
    u, v = motion.nu[:, 0], motion.nu[:, 1]
    cos, sin = np.cos(euler[:, 2]), np.sin(euler[:, 2])
    return np.column_stack([motion.integral(u * cos - v * sin), motion.integral(u * sin + v * cos)])
