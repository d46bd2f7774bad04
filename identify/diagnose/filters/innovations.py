"""Innovations of the axes: their responses to unmodelled forces and reading errors, and their prewhitening.

A disturbance that is not of first order leaves the innovations autocorrelated, and standard errors too small: the first
slow effect tried would seem to explain them (Klein and Morelli 2016, section 5.3, on coloured residuals). An
autoregression of each channel on its own ORDER earlier innovations prewhitens both sides of the regression.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numba import njit
from numpy.typing import NDArray

from bridge.arrays import Array
from bridge.vehicle.coefficients import HEAVE, PITCH, ROLL
from identify.diagnose.causes.evidence import Block
from identify.effects.course import Course
from identify.effects.effect import Act
from identify.estimators.axes.axis import Axis
from identify.estimators.filter.innovations import (
    move_response,
    push_response,
    responses,
    tell_response,
)
from identify.estimators.filter.state import INCREMENT, NO_STEP, POSITION, VELOCITY
from identify.estimators.likelihood.axis import DAMPING, MASS, AxisLikelihood
from identify.estimators.likelihood.scoring import slopes
from identify.estimators.timing.lateness import behind_filter

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

    A few rows with those before them are copied end to end, zeros before the first, so that a lag is one distance for
    all columns, and the loop over them vectorises however few columns there are, with all lags at once.
    """
    if not len(by_lag):
        return
    b1, b2, b3, b4, b5, b6, b7, b8, b9, b10 = (
        by_lag[0], by_lag[1], by_lag[2], by_lag[3], by_lag[4],
        by_lag[5], by_lag[6], by_lag[7], by_lag[8], by_lag[9],
    )  # fmt: skip
    width = values.shape[1]
    lagged, left = np.empty((ORDER + ROWS) * width), np.empty(ROWS * width)
    for end in range(len(rows), 0, -ROWS):
        start = max(end - ROWS, 0)
        for k in range(start - ORDER, end):
            at = (k - start + ORDER) * width
            if k < 0:
                for c in range(width):
                    lagged[at + c] = 0.0
            else:
                for c in range(width):
                    lagged[at + c] = values[rows[k], c]
        for at in range((end - start) * width):
            left[at] = (
                lagged[at + 10 * width]
                - b1 * lagged[at + 9 * width]
                - b2 * lagged[at + 8 * width]
                - b3 * lagged[at + 7 * width]
                - b4 * lagged[at + 6 * width]
                - b5 * lagged[at + 5 * width]
                - b6 * lagged[at + 4 * width]
                - b7 * lagged[at + 3 * width]
                - b8 * lagged[at + 2 * width]
                - b9 * lagged[at + width]
                - b10 * lagged[at]
            )
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
    """Force (t,) of an act along a course, in each degree of freedom in which it is nonzero."""

    by_dof: dict[int, Array]


NO_PUSH = Push({})


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
    return Push({dof: np.ascontiguousarray(row) for dof, row in enumerate(force.T) if row.any()})


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

    def by_force(self, force: Array, early: Array | None = None) -> Array:
        """Normalised innovations (rows, k) in response to forces unknown to the filter: their means (n, k) over each
        step, and over its first half, the same unless given."""
        return self._answer(force, force if early is None else early, np.zeros((0, force.shape[1])))

    def by_reading(self, off: Array) -> Array:
        """Normalised innovations (rows, k) in response to reading errors `off` (n, k)."""
        none = np.zeros((0, off.shape[1]))
        return self._answer(none, none, off)

    def _answer(self, force: Array, early: Array, off: Array) -> Array:
        axis = self.problem.axis
        return np.asarray(
            responses(
                self.table,
                self.problem.step,
                np.ascontiguousarray(force),
                np.ascontiguousarray(early),
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

        indices = range(2 if self.problem.damped == "linear" else 3)
        slope, _ = slopes(under_that_force, np.zeros(3), np.full(3, DIFFERENCE), indices)
        return np.asarray(slope.T / self.std[:, None])

    def by_course(self, course: Course, forces: Sequence[Array], room: int = 0) -> Array:
        """Prewhitened innovations (rows, k) in response to k forces (t,) along a course, as an autopilot's own filter
        shows them; with room for further columns."""
        parts = [
            self._by_course(course, forces[first : first + TOGETHER])
            for first in range(0, len(forces), TOGETHER)
        ]
        if len(parts) == 1 and not room:
            return parts[0]
        out = np.empty((len(self.std), len(forces) + room))
        for k, part in enumerate(parts):
            out[:, k * TOGETHER : k * TOGETHER + part.shape[1]] = part
        return out

    def _by_course(self, course: Course, forces: Sequence[Array]) -> Array:
        axis = self.problem.axis
        columns = behind_filter(_as_columns(np.array(forces)), course.step_s, axis.smoothing_s)
        # Velocities show the area of a force alone.
        placed = bool(np.any(axis.state_read != VELOCITY))
        return self.prewhitened(
            np.asarray(
                _responses_along(
                    self.table,
                    self.problem.step,
                    float(course.time_s[0]),
                    course.step_s,
                    columns,
                    axis.before_s,
                    axis.time_s,
                    placed,
                    self.read,
                    axis.state_read,
                    self.gain,
                    self.std,
                    axis.is_coloured,
                )
            )
        )

    def block(self, acts: Sequence[Act], pushes: Sequence[Push], course: Course) -> Block:
        """Response of the axis' rows to each act and its force; acts without any response are left out."""
        dof = self.problem.axis.dof
        forces = {k: push.by_dof[dof] for k, push in enumerate(pushes) if dof in push.by_dof}
        offs = {
            k: off
            for k, act in enumerate(acts)
            if (off := reading_error(self.problem, act, course)) is not None
        }
        index = {k: i for i, k in enumerate(dict.fromkeys([*forces, *offs]))}
        values = self.by_course(course, [*forces.values()], len(index) - len(forces))
        if offs:
            values[:, len(forces) :] = 0.0
            errors = self.by_reading(_as_columns(np.array([*offs.values()])))
            values[:, [index[k] for k in offs]] += self.prewhitened(errors)
        return Block(np.array([*index], dtype=np.intp), values)


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
        out += value_before(course.time_s, rate, axis.shown_s) * (axis.state_read == VELOCITY)
        if added.any():
            summed = mean_before(course.time_s, rate, axis.time_s - axis.scale, axis.time_s)
            out += summed * axis.scale * added
    if act.water is not None and axis.dof == HEAVE:
        out += _since_first_depth(axis, course, np.cumsum(act.water[:, HEAVE]) * course.step_s)
    if act.depth is not None and axis.dof == HEAVE:
        out += _since_first_depth(axis, course, act.depth[:, 0])
    if angle is not None and angle.any():
        out += value_before(course.time_s, angle, axis.time_s) * (axis.state_read == POSITION)
    return out if out.any() else None


def _since_first_depth(axis: Axis, course: Course, deeper_m: Array) -> Array:
    """Error of an axis' depths (n,) by an error (t,) along a course. The filter begins each run at the first depth that
    it reads there, whatever the error until then."""
    placed = axis.state_read == POSITION
    out = value_before(course.time_s, deeper_m, axis.time_s)
    for run in axis.runs:
        first = out[run][placed[run]][:1]
        out[run] -= first.sum()
    return np.asarray(out * placed)


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


def early_half(means: Array, time_s: Array, values: Array, start_s: Array, end_s: Array) -> Array:
    """Forces (m, k) in the first half of intervals, with which a body gets as far by their end as by values (n, k).

    The second half has twice the means (m, k) less these, so that the area is kept. A gyro's increment shows how far a
    body turned, and is too precise for a force held over all of the interval. Exact for forces that go straight from
    start to end, but for damping, as the halves of `WrenchHistory.halves_between`.
    """
    first = means_before(time_s, values, start_s, 0.5 * (start_s + end_s))
    return np.asarray(means + (4.0 / 3.0) * (first - means) * (end_s > start_s)[:, None])


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
    out = np.zeros((len(start_s), values.shape[1]))
    for k in range(len(start_s)):
        if end_s[k] > start_s[k]:
            _mean_between(began_s, step_s, values, start_s[k], end_s[k], out, k)
    return out


@njit(cache=True, inline="always")
def _mean_between(
    began_s: float, step_s: float, values: Array, start_s: float, end_s: float, out: Array, row: int
) -> None:
    """Fill in a row of means of values (n, k) over an interval that is not empty."""
    count, width = values.shape
    i, early_s = _last(began_s, step_s, count, start_s)
    j, late_s = _last(began_s, step_s, count, end_s)
    by_i, by_j = 0.5 * early_s**2 / step_s, 0.5 * late_s**2 / step_s
    # Of the trapezoids between i and j, each end has half a step.
    ends_s = 0.5 * step_s if i < j else 0.0
    per_s = 1.0 / (end_s - start_s)
    before_i, at_i = by_i * per_s, (ends_s - early_s - by_i) * per_s
    before_j, at_j = -by_j * per_s, (ends_s + late_s + by_j) * per_s
    for c in range(width):
        out[row, c] = (
            before_i * values[i - 1, c]
            + at_i * values[i, c]
            + at_j * values[j, c]
            + before_j * values[j - 1, c]
        )
    for at in range(i + 1, j):
        for c in range(width):
            out[row, c] += step_s * per_s * values[at, c]


@njit(cache=True, nogil=True, error_model="numpy")
def _responses_along(
    table: Array,
    step: NDArray[np.int64],
    began_s: float,
    step_s: float,
    forces: Array,
    before_s: Array,
    time_s: Array,
    placed: bool,
    read: NDArray[np.bool_],
    state_read: NDArray[np.int64],
    gain: Array,
    std: Array,
    coloured: bool,
) -> Array:
    """As `responses`, to forces (t, k), at most TOGETHER, at uniform times from `began_s` on: their means over each
    step and, if `placed`, those of `early_half`, are used as soon as they are made, and never stored."""
    count = forces.shape[1]
    out = np.zeros((std.shape[0], count))
    # Of a length that the compiler knows, which spares it tests whether they overlap.
    x, mean, early = np.zeros((4, TOGETHER)), np.zeros((1, TOGETHER)), np.zeros((1, TOGETHER))
    row = 0
    for i in range(step.shape[0]):
        if step[i] >= 0:
            middle_s = 0.5 * (before_s[i] + time_s[i])
            if time_s[i] > before_s[i]:
                _mean_between(began_s, step_s, forces, before_s[i], time_s[i], mean, 0)
            else:
                mean[:] = 0.0
            move_response(x, table, step[i], count)
            if placed and middle_s > before_s[i]:
                _mean_between(began_s, step_s, forces, before_s[i], middle_s, early, 0)
                for c in range(count):
                    early[0, c] = mean[0, c] + (4.0 / 3.0) * (early[0, c] - mean[0, c])
                push_response(x, table, step[i], mean, early, 0, count)
            else:
                push_response(x, table, step[i], mean, mean, 0, count)
        elif step[i] < NO_STEP:
            x[:] = 0.0
        if read[i]:
            velocity = state_read[i] == VELOCITY
            tell_response(x, velocity, coloured, gain, i, 1.0 / std[row], out, row, count)
            row += 1
        if state_read[i] == INCREMENT:
            for c in range(count):
                x[1, c] = 0.0
    return out
