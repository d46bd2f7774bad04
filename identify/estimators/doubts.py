"""Tests for wrong intervals: a drag that the model lacks, or thrust that acts at another time than assumed.

Tests whether one more force of a known shape would improve a fit, without fitting again.

The Lagrange-multiplier test (Engle 1984, eq. 13): the gradient of the likelihood in the force's size at zero, over
the root of its information with the fitted parameters projected out. The gradient of those parameters is projected
out as well (Neyman 1959, C(alpha)), so the fit need only be near its maximum.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from bridge.vehicle.coefficients import OF_HULL
from identify.estimators.innovations import POSITION
from identify.estimators.lateness import by_lateness
from identify.estimators.likelihood_axis import DAMPING, AxisLikelihood
from identify.estimators.likelihood_joint import JointLikelihood

Array = NDArray[np.float64]


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
    places: tuple[int, ...]

    def tested(self) -> tuple[Multiplier, ...]:
        """Test each of the forces, as if only that force were missing."""
        gradient, information = self.problem.score(self.start)
        prior = self.problem.prior_precision
        gradient = gradient - prior * (self.start - self.problem.prior_mean)
        information = information + np.diag(prior)
        kept = self.kept
        cross = information[np.ix_(kept, np.array(self.places))]
        fitted: Array = np.asarray(information[np.ix_(kept, kept)], dtype=np.float64)
        leanings = -np.linalg.solve(fitted, np.asarray(cross, dtype=np.float64)).T
        return tuple(
            _tested(
                float(gradient[place] + leaning @ gradient[kept]),
                float(information[place, place] + information[place, kept] @ leaning),
                leaning,
            )
            for place, leaning in zip(self.places, leanings, strict=True)
        )

    @property
    def kept(self) -> NDArray[np.intp]:
        """Indices of the parameters (p,) of the likelihood without the forces."""
        return np.setdiff1d(np.arange(len(self.start)), self.places)


def with_forces(joint: JointLikelihood, theta: Array, forces: Sequence[Force]) -> Wider:
    """Return the likelihood with additional forces."""
    problems: list[AxisLikelihood] = []
    starts: list[Array] = []
    places: dict[int, int] = {}
    for problem, place in zip(joint.problems, joint.places, strict=True):
        start = theta[place]
        first = sum(map(len, starts))
        for index, force in enumerate(forces):
            if force.dof == problem.axis.dof:
                places[index] = first + problem.noise_place
                start = np.insert(start, problem.noise_place, 0.0)
                problem = _with_force(problem, force)
        problems.append(problem)
        starts.append(start)
    apart = theta[joint.places[-1].stop :]
    wider = replace(joint, problems=tuple(problems))
    return Wider(wider, np.concatenate([*starts, apart]), tuple(places[i] for i in range(len(forces))))


def _with_force(problem: AxisLikelihood, force: Force) -> AxisLikelihood:
    size, place = max(float(np.sqrt(np.mean(force.shape**2))), 1e-9), problem.noise_place
    return replace(
        problem,
        shapes=np.column_stack([problem.shapes, force.shape]),
        prior_mean=np.insert(problem.prior_mean, place, 0.0),
        prior_precision=np.insert(problem.prior_precision, place, 0.0),
        difference=np.insert(problem.difference, place, 1e-3 / size),
    )


def _tested(pull: float, left: float, leaning: Array) -> Multiplier:
    if not left > 0:
        return Multiplier(0.0, 0.0, 0.0 * leaning)
    return Multiplier(pull / math.sqrt(left), pull / left, leaning)


DOUBTFUL_SCORE = 5.0
DEAF_NOISE = 1e6


@dataclass(frozen=True)
class Doubts:
    """Evidence against the fit of one axis.

    drag: test of a quadratic damping, N/(m/s)^2 or N m/(rad/s)^2, or of a linear damping if the model is quadratic.
    late: test of forces that act later than assumed, in seconds. Their leanings (18,) are of the logarithms of all
    coefficients, in the order of `OF_HULL`, 0 for those not fitted.
    """

    drag: Multiplier
    late: Multiplier

    @property
    def lacks_drag(self) -> bool:
        return abs(self.drag.score) > DOUBTFUL_SCORE

    @property
    def is_late(self) -> bool:
        return abs(self.late.score) > DOUBTFUL_SCORE


def doubts_of(joint: JointLikelihood, theta: Array) -> dict[int, Doubts]:
    """The doubts about a fit that is near its maximum, by degree of freedom."""
    if not joint.problems:
        return {}
    forces = []
    for problem, place in zip(joint.at(theta), joint.places, strict=True):
        forces += [
            Force(problem.axis.dof, lacking_drag(problem, simulated_speed(problem, theta[place]))),
            Force(problem.axis.dof, by_lateness(problem.axis.force, 0.5 * problem.axis.step_s)),
        ]
    rows, theta_places = coefficients(joint)
    tested = [_of_all(test, rows, theta_places) for test in with_forces(joint, theta, forces).tested()]
    return {
        problem.axis.dof: Doubts(_undragged(tested[2 * i], problem), _untimed(tested[2 * i + 1], problem))
        for i, problem in enumerate(joint.problems)
    }


def _undragged(drag: Multiplier, problem: AxisLikelihood) -> Multiplier:
    """A model that has both dampings lacks none."""
    return replace(drag, score=0.0, size=0.0) if problem.damped == "both" else drag


def _untimed(late: Multiplier, problem: AxisLikelihood) -> Multiplier:
    """Slowly sampled commands give no information on lateness."""
    return replace(late, score=0.0, size=0.0) if problem.axis.sampled_s else late


def coefficients(joint: JointLikelihood) -> tuple[list[int], list[int]]:
    """The fitted coefficients, as rows of `OF_HULL`, and their indices in theta."""
    axes = list(zip(joint.problems, joint.places, strict=True))
    linear = [
        (6 + problem.axis.dof, place.start + DAMPING)
        for problem, place in axes
        if problem.damped != "quadratic"
    ]
    squared = [
        (12 + problem.axis.dof, place.start + problem.quadratic_place)
        for problem, place in axes
        if problem.damped != "linear"
    ]
    masses = zip([problem.axis.dof for problem in joint.problems], joint.mass_places, strict=True)
    rows, places = zip(*masses, *linear, *squared, strict=True)
    return list(rows), list(places)


def _of_all(one: Multiplier, rows: Sequence[int], where: Sequence[int]) -> Multiplier:
    leaning = np.zeros(len(OF_HULL))
    leaning[list(rows)] = one.leaning[list(where)]
    return Multiplier(one.score, one.size, leaning)


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
    theta[problem.noise_place : problem.white_place] = np.log(DEAF_NOISE)
    error, _ = problem.filtered(theta, np.inf)
    moving = np.isfinite(error) & (axis.state_read != POSITION)
    if not moving.any():
        return problem.means(theta)[:, 0]
    predicted = ((problem.reading - error) / axis.scale)[moving]
    speed: Array = np.interp(axis.time_s, axis.time_s[moving], predicted)
    return speed
