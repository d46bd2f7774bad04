"""Forces that a fit's model lacks: tests for them, and the coefficients with them included.

The Lagrange-multiplier test (Engle 1984, eq. 13): the gradient of the likelihood in the force's size at zero, over
the root of its information with the fitted parameters projected out. The gradient of those parameters is projected
out as well (Neyman 1959, C(alpha)), so the fit need only be near its maximum.
"""

import math
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from bridge.arrays import Array
from bridge.vehicle.coefficients import OF_HULL
from identify.dive import STAMPED_S
from identify.estimators.filter.state import POSITION
from identify.estimators.likelihood.axis import AxisLikelihood
from identify.estimators.likelihood.joint import JointLikelihood, coefficients
from identify.estimators.likelihood.scoring import climb
from identify.estimators.timing.lateness import LATER_S
from identify.statistics import Z95

DOUBTFUL_SCORE = 5.0
DEAF_NOISE = 1e6

TURNS, SETTLED = 6, 0.1
"""The forces are computed from the speeds and the lateness of the latest fit, at most TURNS times, or until no
coefficient moves by more than SETTLED of its standard error."""


@dataclass(frozen=True)
class Multiplier:
    """Result of the test: `score`, the force's size in standard errors; `size`, after one step of scoring from zero;
    `leaning` (p,), change of the fitted parameters per unit of size."""

    score: float
    size: float
    leaning: Array


@dataclass(frozen=True)
class Force:
    """A force in a fitted degree of freedom: its shape (n,) by event, in N or N m for a size of 1."""

    dof: int
    shape: Array


@dataclass(frozen=True)
class Wider:
    """The likelihood of all axes with additional forces, theta (q,) with all their sizes zero, and the indices of the
    sizes in theta, in the order in which the forces were given."""

    problem: JointLikelihood
    start: Array
    indices: tuple[int, ...]

    def slope(self) -> tuple[Array, Array]:
        """Gradient (q,) and information (q, q) at the start, with those of the priors."""
        gradient, information = self.problem.score(self.start)
        prior = self.problem.prior_precision
        return gradient - prior * (self.start - self.problem.prior_mean), information + np.diag(prior)

    def tested(self) -> tuple[Multiplier, ...]:
        """Test each of the forces, as if only that force were missing."""
        gradient, information = self.slope()
        kept = self.kept
        cross = information[np.ix_(kept, np.array(self.indices))]
        fitted: Array = np.asarray(information[np.ix_(kept, kept)], dtype=np.float64)
        leanings = -np.linalg.solve(fitted, np.asarray(cross, dtype=np.float64)).T
        return tuple(
            _tested(
                float(gradient[index] + leaning @ gradient[kept]),
                float(information[index, index] + information[index, kept] @ leaning),
                leaning,
            )
            for index, leaning in zip(self.indices, leanings, strict=True)
        )

    def included(self) -> tuple[Array, Array]:
        """Change of the fitted parameters (p,) if all the forces are included, by a step of scoring, and the factor
        (p,) on their standard errors."""
        gradient, information = self.slope()
        covariance: Array = np.asarray(np.linalg.pinv(information, hermitian=True))
        kept = self.kept
        narrow: Array = np.asarray(np.linalg.inv(information[np.ix_(kept, kept)]))
        change = (covariance @ gradient)[kept] - narrow @ gradient[kept]
        looser = np.sqrt(np.diag(covariance)[kept] / np.diag(narrow))
        return change, np.maximum(looser, 1.0)

    @property
    def kept(self) -> NDArray[np.intp]:
        """Indices of the parameters (p,) of the likelihood without the forces."""
        return np.setdiff1d(np.arange(len(self.start)), self.indices)


def with_forces(joint: JointLikelihood, theta: Array, forces: Sequence[Force]) -> Wider:
    """Return the likelihood with additional forces."""
    problems: list[AxisLikelihood] = []
    starts: list[Array] = []
    indices: dict[int, int] = {}
    for problem, of_axis in zip(joint.problems, joint.slices, strict=True):
        start = theta[of_axis]
        first = sum(map(len, starts))
        for index, force in enumerate(forces):
            if force.dof == problem.axis.dof:
                indices[index] = first + problem.noise_index
                start = np.insert(start, problem.noise_index, 0.0)
                problem = _with_force(problem, force)
        problems.append(problem)
        starts.append(start)
    apart = theta[joint.slices[-1].stop :]
    wider = replace(joint, problems=tuple(problems))
    return Wider(wider, np.concatenate([*starts, apart]), tuple(indices[i] for i in range(len(forces))))


def _with_force(problem: AxisLikelihood, force: Force) -> AxisLikelihood:
    size, index = max(float(np.sqrt(np.mean(force.shape**2))), 1e-9), problem.noise_index
    return replace(
        problem,
        shapes=np.column_stack([problem.shapes, force.shape]),
        prior_mean=np.insert(problem.prior_mean, index, 0.0),
        prior_precision=np.insert(problem.prior_precision, index, 0.0),
        difference=np.insert(problem.difference, index, 1e-3 / size),
    )


def _tested(pull: float, left: float, leaning: Array) -> Multiplier:
    if not left > 0:
        return Multiplier(0.0, 0.0, 0.0 * leaning)
    return Multiplier(pull / math.sqrt(left), pull / left, leaning)


@dataclass(frozen=True)
class Doubts:
    """Evidence against the fit of one axis.

    drag: test of a quadratic damping, N/(m/s)^2 or N m/(rad/s)^2, or of a linear damping if the model is quadratic.
    late: test of forces that act later than assumed, in seconds. Their leanings (18,) are of the logarithms of all
    coefficients, in the order of `OF_HULL`, 0 for those not fitted. stamped_s: standard error of that time by the
    stamps.
    """

    drag: Multiplier
    late: Multiplier
    stamped_s: float = STAMPED_S

    @property
    def lacks_drag(self) -> bool:
        return abs(self.drag.score) > DOUBTFUL_SCORE

    @property
    def is_late(self) -> bool:
        """Beyond the error of the stamps themselves."""
        return abs(self.late.score) > DOUBTFUL_SCORE and abs(self.late.size) > self.stamped_s

    @property
    def clearest(self) -> float:
        """The larger of both scores."""
        return max(abs(self.drag.score), abs(self.late.score))


def doubts_of(joint: JointLikelihood, theta: Array) -> dict[int, Doubts]:
    """The doubts about a fit that is near its maximum, by degree of freedom."""
    if not joint.problems:
        return {}
    forces = []
    for problem, of_axis in zip(joint.at(theta), joint.slices, strict=True):
        forces += [
            Force(problem.axis.dof, lacking_drag(problem, simulated_speed(problem, theta[of_axis]))),
            Force(problem.axis.dof, problem.axis.by_lateness()),
        ]
    rows, theta_indices = coefficients(joint)
    tested = [_of_all(test, rows, theta_indices) for test in with_forces(joint, theta, forces).tested()]
    return {
        problem.axis.dof: Doubts(
            _undragged(tested[2 * i], problem), _untimed(tested[2 * i + 1], problem), problem.axis.stamped_s
        )
        for i, problem in enumerate(joint.problems)
    }


def _undragged(drag: Multiplier, problem: AxisLikelihood) -> Multiplier:
    """A model that has both dampings lacks none."""
    return replace(drag, score=0.0, size=0.0) if problem.damped == "both" else drag


def _untimed(late: Multiplier, problem: AxisLikelihood) -> Multiplier:
    """Slowly sampled commands give no information on lateness."""
    return replace(late, score=0.0, size=0.0) if problem.axis.sampled_s else late


def by_hidden_steps(joint: JointLikelihood, theta: Array) -> Array:
    """Effect on the logarithms of all coefficients, (k, 18), of what slow samples of the commands hide: each degree of
    freedom's thrust may as well step halfway between them as go straight. That counts as one standard error, because a
    controller's commands in between answer to the motion, and no noise that is independent of it covers them."""
    forces = [
        Force(problem.axis.dof, problem.axis.stepped)
        for problem in joint.problems
        if problem.axis.stepped is not None and problem.axis.stepped.any()
    ]
    if not forces:
        return np.zeros((0, len(OF_HULL)))
    rows, indices = coefficients(joint)
    tested = with_forces(joint, theta, forces).tested()
    return np.array([_of_all(test, rows, indices).leaning for test in tested])


def _of_all(test: Multiplier, rows: Sequence[int], where: Sequence[int]) -> Multiplier:
    leaning = np.zeros(len(OF_HULL))
    leaning[list(rows)] = test.leaning[list(where)]
    return Multiplier(test.score, test.size, leaning)


def by_drag(speed: Array) -> Array:
    """Force (n,) of a unit of quadratic damping at these speeds."""
    return np.asarray(-speed * np.abs(speed))


def lacking_drag(problem: AxisLikelihood, speed: Array) -> Array:
    """Force (n,) at these speeds of a unit of the damping that the model lacks."""
    return -speed if problem.damped == "quadratic" else by_drag(speed)


def simulated_speed(problem: AxisLikelihood, theta: Array) -> Array:
    """Speed (n,) at the events from the model and the forces alone: it shares no noise with the readings."""
    axis = problem.axis
    theta = theta.copy()
    theta[problem.noise_index : problem.white_index] = np.log(DEAF_NOISE)
    error, _ = problem.filtered(theta, np.inf)
    moving = np.isfinite(error) & (axis.state_read != POSITION)
    if not moving.any():
        return problem.means(theta)[:, 0]
    predicted = ((problem.reading - error) / axis.scale)[moving]
    speed: Array = np.interp(axis.time_s, axis.time_s[moving], predicted)
    return speed


@dataclass(frozen=True)
class Admitted:
    """Effect of the included forces on the coefficients, (18,) in the order of `OF_HULL`: `shift` of their
    logarithms, 0 if nothing is included, and `looser`, a factor on their standard errors. timing (k, 18): effect of
    one standard error of each degree of freedom's timing."""

    shift: Array
    looser: Array
    timing: Array

    @property
    def covariance(self) -> Array:
        """Covariance of the logarithms (18, 18), to be added to the fit's covariance."""
        return np.asarray(np.outer(self.shift, self.shift) + self.timing.T @ self.timing)

    def std(self, row: int, std: float) -> float:
        """Standard error of a logarithm, including timing and the error of the model without those forces."""
        return float(np.hypot(self._timed(row, std), self.shift[row]))

    def reach(self, row: int, std: float, stretch: Array) -> tuple[float, float]:
        """Distances of the ends of a logarithm's 95 % interval, below and above; `stretch` (2,): see `JointFit`.

        The shift counts as one more error, because the form of those forces is a guess. The interval also covers that
        of the model with those forces, in case the guess is right.
        """
        shift, timed = self.shift[row], self._timed(row, std)
        whole, loose = float(np.hypot(timed, shift)), timed * self.looser[row]
        below, above = Z95 * stretch
        return float(max(whole * below, loose * below - shift)), float(
            max(whole * above, loose * above + shift)
        )

    def _timed(self, row: int, std: float) -> float:
        return float(np.hypot(std, np.linalg.norm(self.timing[:, row])))


NOTHING = Admitted(np.zeros(len(OF_HULL)), np.ones(len(OF_HULL)), np.zeros((0, len(OF_HULL))))


def timing_of(doubts: Mapping[int, Doubts]) -> Array:
    """Effect of one standard error of force timing on the logarithms, (k, 18), each degree of freedom separately."""
    return STAMPED_S * np.array([doubt.late.leaning for doubt in doubts.values()]).reshape(-1, len(OF_HULL))


def admitted(
    joint: JointLikelihood, theta: Array, lacking: Collection[int], late: Collection[int], timing: Array
) -> Admitted:
    """Fit all axes again from theta with the missing forces: a drag in the degrees of freedom `lacking` it, thrust at
    another time in those that are `late`.

    All axes are fitted together, because a mass also acts in the Coriolis forces of other axes, and with their own
    noise levels. Drag is computed from the posterior mean of the speeds, as Coriolis forces are: the error of that
    mean is independent of it (Berkson 1950).
    """
    if not lacking and not late:
        return replace(NOTHING, timing=timing)
    without = climb(joint, theta)
    rows, indices = coefficients(joint)
    axes = {problem.axis.dof: problem.axis for problem in joint.problems}
    wider, at = Wider(joint, without.theta, ()), without.theta
    coefficient, size = at[indices], dict.fromkeys(late, 0.0)
    for _ in range(TURNS):
        before = coefficient
        lateness = [Force(dof, axes[dof].by_lateness(LATER_S + max(by_s, 0.0))) for dof, by_s in size.items()]
        wider = with_forces(joint, without.theta, [*lateness, *lacking_drags(wider.problem, at, lacking)])
        maximum = climb(wider.problem, wider.start)
        at, kept = maximum.theta, wider.kept
        size = dict(zip(size, at[list(wider.indices)].tolist(), strict=False))
        coefficient, variance = at[kept][indices], np.diag(np.linalg.inv(maximum.precision))[kept][indices]
        if np.max(np.abs(coefficient - before) / np.sqrt(variance)) < SETTLED:
            break
    narrow = np.diag(np.linalg.inv(without.precision))[indices]
    shift, looser = NOTHING.shift.copy(), NOTHING.looser.copy()
    shift[rows] = coefficient - without.theta[indices]
    looser[rows] = np.maximum(np.sqrt(variance / narrow), 1.0)
    return Admitted(shift, looser, timing)


def lacking_drags(joint: JointLikelihood, theta: Array, lacking: Collection[int]) -> list[Force]:
    """The missing drags of these degrees of freedom, at theta's speeds."""
    pairs = zip(joint.at(theta), joint.slices, strict=True)
    return [
        Force(problem.axis.dof, lacking_drag(problem, problem.speed(theta[of_axis])))
        for problem, of_axis in pairs
        if problem.axis.dof in lacking
    ]
