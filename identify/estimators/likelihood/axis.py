"""Likelihood of one axis; `joint` has that of all axes of a vehicle together."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, partial

import numpy as np
from numpy.typing import NDArray

from bridge.arrays import Array
from bridge.vehicle.config import Damping
from identify.estimators.axes.axis import Axis, Brackets
from identify.estimators.filter.information import STEP, gradient_and_information
from identify.estimators.filter.innovations import (
    filtered_means,
    innovations,
    log_likelihood,
    smoothed_velocity,
)
from identify.estimators.filter.state import NO_STEP
from identify.estimators.filter.transitions import transitions
from identify.estimators.likelihood.scoring import Maximum
from identify.estimators.likelihood.spikes import LARGEST_SHARE, spikes

MASS, DAMPING, DISTURBANCE, TIME_CONSTANT, FORCES = range(5)
COLOURED_S = 1.0
"""Prior middle of the time constant of an autopilot's velocity error."""

SLOWEST_COLOURED_S = 5.0
"""Largest such time constant: position or velocity fixes correct a filter within seconds. A slower error would be that
of a steady current on changing headings, and take it up whole."""

FASTEST_S = 0.01
"""Least r of a disturbance, s: no recording shows a faster second pole."""

SLOWEST_S = 0.75
"""Largest r, s: that of a sea of equal poles and 3 s. A slower smooth force is not a sea's, and the fit would replace
it by a larger one."""

RUNAWAY = 1e3
"""m/s or rad/s that no vehicle reaches."""


@dataclass(frozen=True)
class AxisLikelihood:
    """The `scoring.Problem` of one axis.

    theta: log M, log D, log disturbance std (N or N m), log its time constant (s), a factor for each column of
    `shapes` (n, k), then the log noise std of each channel; then, if the axis has them, log white force, and log std
    and log time constant of the velocity readings' coloured error; without such an error, the log odds of the
    disturbance's evenness. `masses` (6,) of all axes give the Coriolis forces. The first shapes are the trim forces,
    constant over a run or over all. Then come the Coriolis forces of the `unmeasured` masses, the drag of a unit of
    quadratic damping, whose factor appears in theta as its logarithm, and the change of thrust per second of timing
    error (`autopilot_velocity`). `reading` (n,): the axis's readings, NaN for those not to be used. `word`: estimate
    of the mass from the other axes' Coriolis forces, and its precision; both are of the mass itself, because those
    forces are linear in it.
    """

    axis: Axis
    masses: Array
    shapes: Array
    unmeasured: tuple[int, ...]
    reading: Array
    prior_mean: Array
    prior_precision: Array
    difference: Array
    word: tuple[float, float] = (0.0, 0.0)
    damped: Damping = "linear"

    def log_likelihood(self, theta: Array) -> float:
        """Log likelihood of the readings and of the estimate in `word`, up to a constant."""
        axis = self.axis
        value = log_likelihood(
            self.transition_table(theta), self.step, self.mean_force(theta), self.reading, axis.state_read,
            self.noise_variance(theta), *self.hidden_levels(theta), axis.initial,
        )  # fmt: skip
        mean, precision = self.word
        return float(value - 0.5 * precision * (np.exp(theta[MASS]) - mean) ** 2)

    def filtered(self, theta: Array, gate_sigma: float) -> tuple[Array, Array]:
        """Innovations and variances of all events, (n,); beyond the gate they are clipped and update nothing."""
        error, variance, _ = self.run_filter(
            theta, self.transition_table(theta), self.mean_force(theta), gate_sigma
        )
        return error, variance

    def score(self, theta: Array, dofs: Sequence[int] = ()) -> tuple[Array, Array]:
        """Gradient (p,) of the log likelihood and information (p, p), by theta and then by the log masses of `dofs`.

        Raises LinAlgError if either is not finite.
        """
        size = len(theta) + len(dofs)
        gradient, information = np.zeros(size), np.zeros((size, size))
        for rows, of_run, information_of_run in self.score_by_run(theta, dofs):
            gradient[rows] += of_run
            information[np.ix_(rows, rows)] += information_of_run
        mean, precision = self.word
        mass = np.exp(theta[MASS])
        gradient[MASS] -= mass * precision * (mass - mean)
        information[MASS, MASS] += mass * mass * precision
        return gradient, information

    def score_by_run(
        self, theta: Array, dofs: Sequence[int] = ()
    ) -> Iterator[tuple[NDArray[np.intp], Array, Array]]:
        """As `score`, of each run's readings: the indices (k,) that it depends on, gradient (k,), information (k, k).

        Raises LinAlgError if either is not finite.
        """
        noise, trims = self.noise_index, self.axis.trims
        curved = [*range(FORCES), *range(noise, len(theta))]
        runs = np.vstack([theta, theta + STEP * np.eye(len(theta))[curved]])
        table, noises = self.transition_table(theta), range(noise, self.white_index)
        tables = [
            table,
            # The noise of a reading moves nothing.
            *(
                table if at in noises else self.transition_table(point)
                for at, point in zip(curved, runs[1:], strict=True)
            ),
        ]
        if self.damped != "linear":
            # Quadratic damping acts twice: as a force at the expected speed, and as a slope about that speed.
            runs = np.vstack([runs, theta])
            tables.append(self.transition_table(theta, 1.0 + STEP))
        slope = [] if self.damped == "linear" else [self.quadratic_index]
        shapes = [*range(FORCES + trims, noise), *range(len(theta), len(theta) + len(dofs))]
        scored = self._scored_runs(theta, runs, np.array(tables), dofs)
        for k, (of_run, information_of_run) in enumerate(scored):
            if not (np.isfinite(of_run).all() and np.isfinite(information_of_run).all()):
                raise np.linalg.LinAlgError("the information is no number")
            ways = [*curved, *slope, FORCES + self.axis.trim_of_run[k], *shapes]
            # A parameter that acts in two ways, as quadratic drag does, has the sum of both.
            rows, of_way = np.unique(np.array(ways, dtype=np.intp), return_inverse=True)
            parts = np.equal.outer(np.arange(len(rows)), of_way).astype(np.float64)
            yield rows, parts @ of_run, parts @ information_of_run @ parts.T

    def _scored_runs(
        self, theta: Array, points: Array, tables: Array, dofs: Sequence[int]
    ) -> Iterator[tuple[Array, Array]]:
        """Gradient and information of each run by itself, since the filter forgets all at its end.

        Of the linear parameters come its own trim, the other shapes and the log masses of `dofs`.
        """
        axis, force, trims, by_theta = (
            self.axis,
            self.mean_force(theta),
            self.axis.trims,
            self.by_theta(theta),
        )
        of_masses = np.array(dofs, dtype=np.int64)
        noise = self._variances(points[:, self.noise_index : self.white_index])
        disturbance, fourth = np.ascontiguousarray(
            np.array([self.hidden_levels(point)[:2] for point in points]).T
        )
        for k, (run, trim, (of_run, at)) in enumerate(
            zip(axis.runs, axis.trim_of_run, self._steps_of_runs, strict=True)
        ):
            # Of one layout in memory each: the compiler makes the kernel anew for every other.
            rows, shapes, coriolis = map(
                np.ascontiguousarray, (tables[:, of_run], by_theta[run], axis.coriolis[run])
            )
            used = np.array([trim, *range(trims, by_theta.shape[1])], dtype=np.int64)
            yield gradient_and_information(
                rows, at, force[run], shapes, used, coriolis, of_masses, self.masses[of_masses],
                self.reading[run], axis.state_read[run], noise, axis.channel[run], axis.scale[run], disturbance,
                fourth, axis.is_coloured, axis.initial[k],
            )  # fmt: skip

    def speed(self, theta: Array) -> Array:
        """Velocity (n,) at every event given all readings and the parameters."""
        axis = self.axis
        return np.asarray(
            smoothed_velocity(
                self.transition_table(theta), self.step, self.mean_force(theta), self.reading, axis.state_read,
                self.noise_variance(theta), *self.hidden_levels(theta), axis.initial,
            )
        )  # fmt: skip

    def means(self, theta: Array) -> Array:
        """The filter's mean of velocity, its integral and the disturbance after each event, (n, 3)."""
        return self._means(theta)[0]

    def _means(self, theta: Array) -> tuple[Array, Array]:
        """As `means`, together with the change of the means by each event's reading, (n, 3)."""
        table, force, axis = self.transition_table(theta), self.mean_force(theta), self.axis
        error, _, gain = self.run_filter(theta, table, force, np.inf)
        error = np.nan_to_num(error)
        means = filtered_means(table, self.step, force, error, gain, axis.state_read, axis.initial)
        return np.asarray(means, dtype=np.float64), gain[:, :3] * error[:, None]

    def expected_speeds(self, theta: Array) -> tuple[Array, Array]:
        """Velocity (n,) over each step, predicted from the earlier readings, and before an autopilot's filter.

        The braking force must not depend on the readings that are to be explained. A velocity smoothed over the whole
        dive does depend on them, and the drag made of it would come out too small.
        """
        means, by_reading = self._means(theta)
        after, before = means[:, 0], means[:, 0] - by_reading[:, 0]
        start, step_s = np.concatenate([after[:1], after[:-1]]), self.axis.step_s
        start = np.where(self.axis.step < NO_STEP, before, start)
        speed = 0.5 * (start + before)
        if self.axis.smoothing_s <= 0:
            return speed, speed
        # Speeds that run away are the caller's to refuse.
        with np.errstate(invalid="ignore"):
            change = (before - start) / np.where(step_s > 0, step_s, np.inf)
        return speed, speed + self.axis.smoothing_s * change

    def slowed(self, theta: Array) -> "AxisLikelihood":
        """Return the same problem with the drag of the speed that is expected at theta.

        Raises LinAlgError if that speed diverges.
        """
        speed, before_filter = self.expected_speeds(theta)
        if not np.max(np.abs(speed)) < RUNAWAY:
            raise np.linalg.LinAlgError("the speeds that are expected from there run away")
        return self.with_axis(replace(self.axis, speed=speed, before_filter=before_filter))

    def with_axis(self, axis: Axis) -> "AxisLikelihood":
        """Return the same problem of another axis, with the shapes of that."""
        return replace(self, axis=axis, shapes=shapes_of(axis, self.unmeasured, self.damped))

    @property
    def noise_index(self) -> int:
        """Index in theta of the first channel's noise."""
        return FORCES + int(self.shapes.shape[1])

    @property
    def _brackets(self) -> Brackets:
        straight = self.damped == "linear" and not self.axis.quadratic
        return self.axis.one_bracket if straight else self.axis.brackets

    @cached_property
    def _steps_of_runs(self) -> list[tuple[slice | NDArray[np.int64], NDArray[np.int64]]]:
        """Of each run, the rows of `transition_table` that its steps use, and the steps among these alone."""
        if len(self.axis.runs) == 1:
            return [(slice(None), self.step)]
        runs: list[tuple[slice | NDArray[np.int64], NDArray[np.int64]]] = []
        for run in self.axis.runs:
            rows, at = np.unique(np.maximum(self.step[run], 0), return_inverse=True)
            runs.append((rows, np.where(self.step[run] < 0, NO_STEP, at)))
        return runs

    @property
    def step(self) -> NDArray[np.int64]:
        """Row of `transition_table` that leads to each event, (n,); NO_STEP and less as in the axis."""
        return self._brackets.step

    def transition_table(self, theta: Array, quadratic_times: float = 1.0) -> Array:
        """Transitions for all distinct steps and speed brackets of the axis. quadratic_times: factor on the quadratic
        damping at theta."""
        mass, damping, disturbance, time_constant = np.exp(theta[:FORCES]).tolist()
        axis, coloured = self.axis, self.coloured(theta)
        quadratic = axis.quadratic + quadratic_times * self.quadratic(theta)
        white = self.white_force(theta) * axis.white_times
        disturbances = np.hypot(disturbance, mass * np.broadcast_to(axis.misread, white.shape))
        return np.asarray(
            transitions(
                axis.different_s, mass, damping + quadratic * self._brackets.slopes, axis.stiffness,
                disturbances, time_constant, self.rise_s(theta), white, *coloured, axis.smoothing_s,
            )
        )  # fmt: skip

    def mean_force(self, theta: Array) -> Array:
        """Force in both halves of every step (n, 2), N or N m: thrust, Coriolis forces, and all shapes."""
        axis = self.axis
        by_speed = self.shapes @ self.factors(theta) + axis.coriolis @ self.masses
        if self.damped != "linear" or axis.quadratic:
            about, beyond = axis.brackets.about
            by_speed += self.quadratic(theta) * about + axis.quadratic * beyond
        force = axis.force.copy()
        force[:, 0] += by_speed
        force[:, 1] += by_speed
        return force

    @property
    def quadratic_index(self) -> int:
        """Index in theta of the log quadratic damping; -1 if the model has none."""
        return -1 if self.damped == "linear" else FORCES + self.axis.trims + len(self.unmeasured)

    def quadratic(self, theta: Array) -> float:
        """Quadratic damping in theta, N/(m/s)2 or N m/(rad/s)2."""
        return 0.0 if self.damped == "linear" else float(np.exp(theta[self.quadratic_index]))

    @property
    def slope(self) -> Array:
        """Slope (n,) of a unit of quadratic damping at the speed of each step. The filter's own dynamics contain it,
        because a force of expected speeds alone damps no error (Jazwinski 1970, section 8.3)."""
        return self._brackets.slope

    def factors(self, theta: Array) -> Array:
        """Factors of the shapes, (k,)."""
        out = theta[FORCES : self.noise_index].copy()
        if self.damped != "linear":
            out[self.quadratic_index - FORCES] = self.quadratic(theta)
        return out

    def by_theta(self, theta: Array) -> Array:
        """Derivative of the shapes' forces by their part of theta, (n, k)."""
        if self.damped == "linear":
            return self.shapes
        out = self.shapes.copy()
        column = out[:, self.quadratic_index - FORCES]
        column[:] = self.quadratic(theta) * (column + self.slope * self.axis.speed)
        return out

    def noise_variance(self, theta: Array) -> Array:
        """Noise variance of every event's reading (n,), in the reading's unit squared."""
        noise = theta[self.noise_index : self.white_index]
        return np.asarray(self._variances(noise)[self.axis.channel] * self.axis.scale**2)

    def _variances(self, log_noise: Array) -> Array:
        """Noise variances (..., channels) of logarithms of the noise, each at least its channel's least."""
        least = np.array([channel.noise_least for channel in self.axis.channels])
        return np.asarray(np.maximum(np.exp(2 * log_noise), least**2))

    @property
    def white_index(self) -> int:
        """Index in theta of the white force, if the axis has one."""
        return self.noise_index + len(self.axis.channels)

    @property
    def coloured_index(self) -> int:
        """Index in theta of the log standard deviation of the velocity readings' coloured error, if the axis has one;
        its log time constant follows."""
        return self.white_index + (self.axis.white_force > 0.0)

    def white_force(self, theta: Array) -> float:
        """White force, N (N m) per root of 1/s; 0 if pulses are not rounded."""
        return float(np.exp(theta[self.white_index])) if self.axis.white_force else 0.0

    def coloured(self, theta: Array) -> tuple[float, float]:
        """Standard deviation of the velocity readings' coloured error, and its time constant in s."""
        if not self.axis.is_coloured:
            return 0.0, COLOURED_S
        std, time_s = np.exp(theta[self.coloured_index :])
        return float(std), _lesser(time_s, SLOWEST_COLOURED_S)

    def rise_s(self, theta: Array) -> float:
        """r of a disturbance of second order, s (`filter.state`); 0 for one of first order."""
        if self.axis.is_coloured:
            return 0.0
        evenness = 1.0 / (1.0 + np.exp(-theta[-1]))
        of_equal_poles = 0.25 * np.exp(theta[TIME_CONSTANT])
        return float(FASTEST_S + evenness * _lesser(of_equal_poles, SLOWEST_S))

    def hidden_levels(self, theta: Array) -> tuple[float, float, bool]:
        """Standard deviations of the disturbance and of the filter's fourth state, and whether that is an error of the
        velocity readings."""
        disturbance = np.exp(theta[DISTURBANCE])
        if self.axis.is_coloured:
            return float(disturbance), self.coloured(theta)[0], True
        # A time constant that rounds to none makes this infinite, and the likelihood of it none.
        rate = disturbance / np.sqrt(self.rise_s(theta) * np.exp(theta[TIME_CONSTANT]))
        return float(disturbance), float(rate), False

    def run_filter(
        self, theta: Array, table: Array, force: Array, gate_sigma: float
    ) -> tuple[Array, Array, Array]:
        """Innovations (n,), their variances (n,) and gains for a `table` and a `force` already computed from
        `theta`."""
        axis = self.axis
        error, variance, gain = innovations(
            table, self.step, force, self.reading, axis.state_read, self.noise_variance(theta),
            *self.hidden_levels(theta), axis.initial, gate_sigma,
        )  # fmt: skip
        return error, variance, gain

    def without_spikes(self, theta: Array) -> Array:
        """The readings (n,) with a sensor's spikes at `theta` replaced by NaN; as they are if too many would be left
        out."""
        axis, read = self.axis, np.isfinite(self.axis.reading)
        is_spike = spikes(partial(self.filtered, theta), axis.state_read, np.cumsum(axis.step < NO_STEP))
        left_out = is_spike | (read & ~np.isfinite(self.reading))
        if left_out.sum() > LARGEST_SHARE * read.sum():
            return self.reading
        return np.where(is_spike, np.nan, self.reading)


@dataclass(frozen=True)
class AxisFit:
    """The maximum of one axis, its problem, and the covariance (p, p) of its theta."""

    problem: AxisLikelihood
    maximum: Maximum
    covariance: Array


def _lesser(value: float, most: float) -> float:
    """The lesser of both, without an edge."""
    return float((value**-4.0 + most**-4.0) ** -0.25)


def shapes_of(axis: Axis, unmeasured: Sequence[int], damped: Damping) -> Array:
    """Forces of unit factors, (n, k), in the order of theta."""
    drag = [] if damped == "linear" else [-axis.squared]
    late = [timing.force for timing in axis.timing]
    trims = np.zeros((len(axis.force), axis.trims))
    for run, trim in zip(axis.runs, axis.trim_of_run, strict=True):
        trims[run, trim] = 1.0
    return np.column_stack([trims, axis.coriolis[:, list(unmeasured)], *drag, *late])
