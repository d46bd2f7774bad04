"""Innovations of the axes: their responses to unmodelled forces and reading errors, their prewhitening, and predicted
motion.

A disturbance that is not of first order leaves the innovations autocorrelated, and standard errors too small: the first
slow effect tried would seem to explain them (Klein and Morelli 2016, section 5.3, on coloured residuals). An
autoregression of each channel on its own ORDER earlier innovations prewhitens both sides of the regression.

A regressor of an innovation must not depend on it. So velocities and the course are those that the filters predict from
earlier readings alone, not velocities smoothed over the whole dive.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numba import njit
from numpy.typing import NDArray

from bridge.errors import FitError
from bridge.vehicle.config import VehicleFile
from identify.diagnose.evidence import Block
from identify.dive import Dive, Signal
from identify.effects.course import Course
from identify.effects.effect import Act
from identify.estimators.axes import Axis
from identify.estimators.innovations import INCREMENT, POSITION, VELOCITY, responses
from identify.estimators.lateness import FilteredForce, behind_filter
from identify.estimators.likelihood_axis import DAMPING, MASS, AxisLikelihood
from identify.estimators.likelihood_joint import JointLikelihood
from identify.estimators.motion import Motion
from identify.estimators.readings import HEAVE, PITCH, ROLL
from identify.estimators.scoring import slopes
from identify.forces import asked_thrusts, evenly_between, tells_thrusters, unrounded_thrusts
from identify.ingest.commands import unknown_between
from identify.ingest.rotation import euler_angles, turned_on
from identify.side_by_side import side_by_side

Array = NDArray[np.float64]

ORDER = 10
LEAST_ROWS = 20 * ORDER

DIFFERENCE = 1e-4
"""Step of the logarithm of a coefficient for derivatives."""

TOGETHER = 16
"""Forces answered together: as many as stay in a processor's cache."""

ROWS = 32
"""Rows that are prewhitened together: few enough for the cache with all their columns."""


@dataclass(frozen=True)
class Autoregression:
    """Autoregression of a channel: `rows` (m,) in order of time, and coefficients by lag, nearest first."""

    rows: NDArray[np.intp]
    by_lag: Array

    def prewhitened(self, values: Array) -> None:
        """Prewhiten values (n, k) in place; the first rows use only as many lags as they have earlier rows."""
        _prewhitened(values, self.rows, self.by_lag)


@njit(cache=True, nogil=True)
def _prewhitened(values: Array, rows: NDArray[np.intp], by_lag: Array) -> None:
    """Prewhiten in place from the last rows back, because earlier rows must still hold their values.

    A few rows with those before them are copied end to end, so that a lag is one distance for all columns, and its
    loop vectorises however few columns there are.
    """
    width, order = values.shape[1], len(by_lag)
    lagged, left = np.empty((order + ROWS) * width), np.empty(ROWS * width)
    for end in range(len(rows), 0, -ROWS):
        start = max(end - ROWS, 0)
        first = max(start - order, 0)
        for k in range(end - first):
            for c in range(width):
                lagged[k * width + c] = values[rows[first + k], c]
        offset, size = (start - first) * width, (end - start) * width
        left[:size] = lagged[offset : offset + size]
        for lag in range(1, order + 1):
            without = min(max(lag - start, 0) * width, size)
            share, later, earlier = (
                by_lag[lag - 1],
                left[without:size],
                lagged[offset - lag * width + without :],
            )
            for at in range(len(later)):
                later[at] -= share * earlier[at]
        for k in range(end - start):
            for c in range(width):
                values[rows[start + k], c] = left[k * width + c]


def autoregression_of(rows: NDArray[np.intp], innovations: Array) -> Autoregression:
    """Coefficients by the Yule-Walker equations of `innovations` (n,) at some rows; none for few rows."""
    return autoregressions_of([rows], innovations)[0]


def autoregressions_of(runs: Sequence[NDArray[np.intp]], innovations: Array) -> list[Autoregression]:
    """As `autoregression_of`, for the rows of each run: with common coefficients, and no lag into the run before."""
    count = sum(map(len, runs))
    if count < LEAST_ROWS:
        return [Autoregression(rows, np.zeros(0)) for rows in runs]
    mean = sum(float(innovations[rows].sum()) for rows in runs) / count
    products = np.zeros(ORDER + 1)
    for rows in runs:
        series = innovations[rows] - mean
        products += [float(series[lag:] @ series[: max(len(series) - lag, 0)]) for lag in range(ORDER + 1)]
    table = products[np.abs(np.subtract.outer(np.arange(ORDER), np.arange(ORDER)))]
    by_lag = np.asarray(np.linalg.solve(table, products[1:]))
    return [Autoregression(rows, by_lag) for rows in runs]


@dataclass(frozen=True)
class Push:
    """Force of an act along a course: force (6, t), and the degrees of freedom in which it is nonzero."""

    force: Array
    dofs: frozenset[int]


NO_PUSH = Push(np.zeros((6, 0)), frozenset())


def push_of(act: Act, course: Course) -> Push:
    """The force of an act along a course.

    A filter whose readings are over ground adds Coriolis forces of moving water. In roll and pitch these are left
    out: they depend on the heave velocity, which is small and poorly predicted, while the gyros there are precise.
    """
    force = act.wrench
    if act.water is not None:
        turned = course.turned_by(act.water)
        turned[:, [ROLL, PITCH]] = 0.0
        force = turned if force is None else force + turned
    if force is None:
        return NO_PUSH
    rows = np.ascontiguousarray(force.T)
    return Push(rows, frozenset(np.flatnonzero((rows != 0.0).any(axis=1)).tolist()))


@dataclass(frozen=True)
class AxisInnovations:
    """An axis: its likelihood at `theta`, its filter's table and gains, its innovations with their standard
    deviations, and an autoregression for each channel in each run."""

    problem: AxisLikelihood
    theta: Array
    table: Array
    gain: Array
    error: Array
    std: Array
    autoregressions: tuple[Autoregression, ...]

    def prewhitened(self, columns: Array) -> Array:
        """Columns (rows, k), prewhitened in place."""
        for autoregression in self.autoregressions:
            autoregression.prewhitened(columns)
        return columns

    @cached_property
    def read(self) -> NDArray[np.bool_]:
        return np.isfinite(self.problem.reading)

    def by_force(self, force: Array) -> Array:
        """Normalised innovations (rows, k) in response to forces (n, k) unknown to the filter."""
        return self._answer(force, np.zeros((0, force.shape[1])))

    def by_reading(self, off: Array) -> Array:
        """Normalised innovations (rows, k) in response to reading errors `off` (n, k)."""
        return self._answer(np.zeros((0, off.shape[1])), off)

    def _answer(self, force: Array, off: Array) -> Array:
        axis = self.problem.axis
        return np.asarray(
            responses(
                self.table,
                self.problem.step,
                force,
                off,
                self.read,
                axis.state_read,
                self.gain,
                self.std,
                axis.is_coloured,
            )
        )

    def by_motion(self) -> Array:
        """Normalised innovations (rows, 3) per unit of log mass, log damping, and the log of the quadratic damping in
        the filter's own dynamics; (rows, 2) with linear damping alone."""
        force = self.problem.mean_force(self.theta)

        def under_that_force(more: Array) -> tuple[Array, Array]:
            moved = self.theta.copy()
            moved[[MASS, DAMPING]] += more[:2]
            table = self.problem.transition_table(moved, float(np.exp(more[2])))
            error, variance, _ = self.problem.run_filter(moved, table, force, np.inf)
            return error[self.read], variance[self.read]

        places = range(2 if self.problem.damped == "linear" else 3)
        slope, _ = slopes(under_that_force, np.zeros(3), np.full(3, DIFFERENCE), places)
        return np.asarray(slope.T / self.std[:, None])

    def by_course(self, course: Course, forces: Sequence[Array], room: int = 0) -> Array:
        """Prewhitened innovations (rows, k) in response to k forces (t,) along a course, as an autopilot's own filter
        shows them; with room for further columns."""
        time_s = self.problem.axis.time_s
        before = self.problem.axis.before_s
        out = np.empty((len(self.std), len(forces) + room))
        for first in range(0, len(forces), TOGETHER):
            some = slice(first, first + TOGETHER)
            columns = _as_columns(np.array(forces[some]))
            smooth = behind_filter(columns, course.step_s, self.problem.axis.smoothing_s)
            means = means_before(course.time_s, smooth, before, time_s)
            out[:, first : first + means.shape[1]] = self.prewhitened(self.by_force(means))
        return out

    def block(self, acts: Sequence[Act], pushes: Sequence[Push], course: Course) -> Block:
        """Response of the axis' rows to each act and its force; acts without any response are left out."""
        dof = self.problem.axis.dof
        forces = {k: push.force[dof] for k, push in enumerate(pushes) if dof in push.dofs}
        offs = {
            k: off
            for k, act in enumerate(acts)
            if (off := reading_error(self.problem, act, course)) is not None
        }
        place = {k: i for i, k in enumerate(dict.fromkeys([*forces, *offs]))}
        values = self.by_course(course, [*forces.values()], len(place) - len(forces))
        if offs:
            values[:, len(forces) :] = 0.0
            errors = self.by_reading(_as_columns(np.array([*offs.values()])))
            values[:, [place[k] for k in offs]] += self.prewhitened(errors)
        return Block(np.array([*place], dtype=np.intp), values)


@njit(cache=True, nogil=True)
def _as_columns(rows: Array) -> Array:
    """Rows (k, n) as columns (n, k), all at once: one after the other, each would go through all memory again."""
    out = np.empty((rows.shape[1], rows.shape[0]))
    for i in range(rows.shape[1]):
        for c in range(rows.shape[0]):
            out[i, c] = rows[c, i]
    return out


def reading_error(problem: AxisLikelihood, act: Act, course: Course) -> Array | None:
    """Error of an axis' readings (n,) by an act; None if it has none."""
    axis = problem.axis
    wrong = act.beyond if axis.dof < 3 else act.gyro
    rate = None if wrong is None else wrong[:, axis.dof % 3]
    angle = None if act.attitude is None or axis.dof < 3 else act.attitude[:, axis.dof - 3]
    out = np.zeros(len(axis.time_s))
    if rate is not None and rate.any():
        added = axis.state_read == INCREMENT
        out += value_before(course.time_s, rate, axis.time_s) * (axis.state_read == VELOCITY)
        if added.any():
            summed = mean_before(course.time_s, rate, axis.time_s - axis.scale, axis.time_s)
            out += summed * axis.scale * added
    if act.water is not None and axis.dof == HEAVE:
        sunk = np.cumsum(act.water[:, HEAVE]) * course.step_s
        out += value_before(course.time_s, sunk, axis.time_s) * (axis.state_read == POSITION)
    if act.depth is not None and axis.dof == HEAVE:
        # The first depth that is read is where the filter begins, whatever the sensor's gain.
        deeper = act.depth[:, 0] - act.depth[0, 0]
        out += value_before(course.time_s, deeper, axis.time_s) * (axis.state_read == POSITION)
    if angle is not None and angle.any():
        out += value_before(course.time_s, angle, axis.time_s) * (axis.state_read == POSITION)
    return out if out.any() else None


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
    problems = joint.at(theta)

    def along(k: int) -> None:
        problem, theta_axis = problems[k], theta[joint.places[k]]
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
    euler = euler_ahead(dive.attitude, at, dive.breaks_s)
    # Depth grows and altitude shrinks with the heave velocity, nearly.
    depth, altitude = dive.depth_by(file.vehicle.water), dive.altitude
    return Course(
        shape,
        time_s,
        at.nu,
        at.nu_dot,
        euler,
        reading_ahead(depth, time_s, at.nu[:, HEAVE], dive.breaks_s),
        reading_ahead(altitude, time_s, -at.nu[:, HEAVE], dive.breaks_s),
        _position(Motion(time_s, at.nu), euler, dive.breaks_s),
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
    if tells_thrusters(dive, shape):
        asked = asked_thrusts(dive, file, configuration)
        if not unknown_between(dive, asked):
            return unrounded_thrusts(asked, dive, file, configuration)
    elif dive.tau_cmd is not None and len(dive.tau_cmd):
        asked = dive.tau_cmd
    else:
        raise FitError(
            f"neither pulses for the {len(shape.thrusters)} thrusters nor a wrench are recorded; record "
            "ACTUATOR_OUTPUT_STATUS or SERVO_OUTPUT_RAW",
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
    disturbance that turned the hull between them.
    """
    if attitude is None or not len(attitude):
        return np.zeros((len(at.time_s), 3))
    last = _last_before(attitude.time_s, at.time_s, breaks_s)
    turn = _since(attitude.time_s[last], at.time_s, at.nu[:, 3:])
    roll, pitch, heading = euler_angles(turned_on(attitude.value[last], turn))
    return np.column_stack([np.unwrap(roll), pitch, np.unwrap(heading)])


def _last_before(read_s: Array, time_s: Array, breaks_s: Array) -> NDArray[np.intp]:
    """The last of some readings before each time, (n,); the first of its run where there is none."""
    last = np.maximum(np.searchsorted(read_s, time_s - APART_S, side="left") - 1, 0)
    of_earlier_run = np.searchsorted(breaks_s, read_s[last]) < np.searchsorted(breaks_s, time_s)
    return np.asarray(np.minimum(last + of_earlier_run, len(read_s) - 1))


def _since(start_s: Array, time_s: Array, rate: Array) -> Array:
    """Integrals (n, k) of rates (n, k) at uniform times (n,), up to each of these; 0 before the start."""
    motion = Motion(time_s, rate)
    total = np.column_stack([motion.integral(column) for column in rate.T])
    begun = np.column_stack([np.interp(start_s, time_s, column) for column in total.T])
    return np.asarray((total - begun) * (start_s < time_s)[:, None])


def _position(motion: Motion, euler: Array, breaks_s: Array) -> Array:
    """North and east (n, 2) by dead reckoning from the beginning of each run."""
    u, v = motion.nu[:, 0], motion.nu[:, 1]
    cos, sin = np.cos(euler[:, 2]), np.sin(euler[:, 2])
    way = np.column_stack([motion.integral(u * cos - v * sin), motion.integral(u * sin + v * cos)])
    runs = np.split(way, np.searchsorted(motion.time_s, breaks_s))
    return np.vstack([run - run[:1] for run in runs])
