"""The innovations of an axis: responses to forces and reading errors unknown to its filter, and prewhitening.

A disturbance that is not of first order leaves the innovations autocorrelated. Standard errors that ignore this are
too small, and the first slow effect tried would seem to explain them (Klein and Morelli 2016, section 5.3, on
coloured residuals). An autoregression of each channel on its own ORDER earlier innovations prewhitens both sides of
the regression; it does nothing to white innovations.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numba import njit
from numpy.typing import NDArray

from identify.diagnose.evidence import Block
from identify.diagnose.predicted import mean_before, means_before, value_before
from identify.effects.course import Course
from identify.effects.effect import Act
from identify.estimators.innovations import INCREMENT, POSITION, VELOCITY
from identify.estimators.lateness import behind_filter
from identify.estimators.likelihood_axis import DAMPING, MASS, AxisLikelihood
from identify.estimators.readings import HEAVE, PITCH, ROLL
from identify.estimators.scoring import slopes

Array = NDArray[np.float64]

ORDER = 10
LEAST_ROWS = 20 * ORDER

DIFFERENCE = 1e-4
"""Step of the logarithm of a coefficient for derivatives."""

TOGETHER = 32
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
    own, left = np.empty((order + ROWS) * width), np.empty(ROWS * width)
    for end in range(len(rows), 0, -ROWS):
        start = max(end - ROWS, 0)
        first = max(start - order, 0)
        for k in range(end - first):
            for c in range(width):
                own[k * width + c] = values[rows[first + k], c]
        offset, size = (start - first) * width, (end - start) * width
        left[:size] = own[offset : offset + size]
        for lag in range(1, order + 1):
            without = min(max(lag - start, 0) * width, size)
            share, later, earlier = by_lag[lag - 1], left[without:size], own[offset - lag * width + without :]
            for at in range(len(later)):
                later[at] -= share * earlier[at]
        for k in range(end - start):
            for c in range(width):
                values[rows[start + k], c] = left[k * width + c]


def autoregression_of(rows: NDArray[np.intp], innovations: Array) -> Autoregression:
    """Coefficients by the Yule-Walker equations of `innovations` (n,) at some rows; none for few rows."""
    series = innovations[rows]
    if len(series) < LEAST_ROWS:
        return Autoregression(rows, np.zeros(0))
    series = series - series.mean()
    products = np.array([float(series[lag:] @ series[: len(series) - lag]) for lag in range(ORDER + 1)])
    table = products[np.abs(np.subtract.outer(np.arange(ORDER), np.arange(ORDER)))]
    return Autoregression(rows, np.asarray(np.linalg.solve(table, products[1:])))


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
    return Push(rows, frozenset(np.flatnonzero(rows.any(axis=1)).tolist()))


@dataclass(frozen=True)
class AxisInnovations:
    """An axis: its likelihood at `theta`, its filter's table and gains, its innovations with their standard
    deviations, and an autoregression for each channel."""

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
            _responses(
                self.table, self.problem.step, force, off, self.read, axis.state_read, self.gain, self.std
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

    def by_course(self, course: Course, forces: Sequence[Array]) -> Array:
        """Prewhitened innovations (rows, k) in response to k forces (t,) along a course, as an autopilot's own filter
        shows them."""
        time_s = self.problem.axis.time_s
        before = np.concatenate([time_s[:1], time_s[:-1]])
        out = np.empty((len(self.std), len(forces)))
        for first in range(0, len(forces), TOGETHER):
            some = slice(first, first + TOGETHER)
            smooth = behind_filter(
                np.column_stack(forces[some]), course.step_s, self.problem.axis.smoothing_s
            )
            columns = self.by_force(means_before(course.time_s, smooth, before, time_s))
            out[:, some] = self.prewhitened(columns)
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
        values = self.by_course(course, [*forces.values()]) if forces else np.zeros((len(self.std), 0))
        if not offs:
            return Block(np.array([*forces], dtype=np.intp), values)
        responding = sorted({*forces, *offs})
        place = {k: i for i, k in enumerate(responding)}
        both = np.zeros((len(self.std), len(responding)))
        both[:, [place[k] for k in forces]] = values
        both[:, [place[k] for k in offs]] += self.prewhitened(
            self.by_reading(np.column_stack([*offs.values()]))
        )
        return Block(np.array(responding, dtype=np.intp), both)


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
    if angle is not None and angle.any():
        out += value_before(course.time_s, angle, axis.time_s) * (axis.state_read == POSITION)
    return out if out.any() else None


@njit(cache=True, nogil=True, error_model="numpy")
def _responses(
    table: Array,
    step: NDArray[np.int64],
    force: Array,
    off: Array,
    read: NDArray[np.bool_],
    state_read: NDArray[np.int64],
    gain: Array,
    std: Array,
) -> Array:
    """Innovations (rows, k) over `std` (rows,) of a filter with given gains (n, 3), in response to unknown inputs.

    force, off: forces and reading errors, (n, k) each, or (0, k) for none. x is the vehicle's state less the
    filter's. Columns are computed together for vectorisation.
    """
    count = force.shape[1]
    pushed, wrong = len(force) > 0, len(off) > 0
    out = np.empty((std.shape[0], count))
    x0, x1, x2, x3 = np.zeros(count), np.zeros(count), np.zeros(count), np.zeros(count)
    row = 0
    for i in range(step.shape[0]):
        if step[i] >= 0:
            t = table[step[i]]
            t0, t1, t2, t3, t4, t5, t6, keep = t[0], t[1], t[2], t[3], t[4], t[5], t[6], t[17]
            for c in range(count):
                a, b, d = x0[c], x1[c], x2[c]
                x0[c] = t0 * a + t1 * b + t2 * d
                x1[c] = t3 * a + t4 * b + t5 * d
                x2[c] = t6 * d
                x3[c] *= keep
            if pushed:
                to_nu, to_x = t[7] + t[9], t[8] + t[10]
                for c in range(count):
                    x0[c] += to_nu * force[i, c]
                    x1[c] += to_x * force[i, c]
        if read[i]:
            k0, k1, k2, k3, scale = gain[i, 0], gain[i, 1], gain[i, 2], gain[i, 3], 1.0 / std[row]
            velocity = state_read[i] == VELOCITY
            for c in range(count):
                e = x0[c] + x3[c] if velocity else x1[c]
                if wrong:
                    e += off[i, c]
                out[row, c] = scale * e
                x0[c] -= k0 * e
                x1[c] -= k1 * e
                x2[c] -= k2 * e
                x3[c] -= k3 * e
            row += 1
        if state_read[i] == INCREMENT:
            x1[:] = 0.0
    return out
