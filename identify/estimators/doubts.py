"""Tests for wrong intervals: a drag that the model lacks, or thrust that acts at another time than assumed."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from bridge.vehicle.coefficients import OF_HULL
from identify.estimators.innovations import POSITION
from identify.estimators.lateness import by_lateness
from identify.estimators.likelihood_axis import DAMPING, AxisLikelihood
from identify.estimators.likelihood_joint import JointLikelihood
from identify.estimators.multiplier import Force, Tested, with_forces

Array = NDArray[np.float64]

DOUBTFUL_SCORE = 5.0
DEAF_NOISE = 1e6


@dataclass(frozen=True)
class Doubts:
    """Evidence against the fit of one axis.

    drag: test of a quadratic damping, N/(m/s)^2 or N m/(rad/s)^2, or of a linear damping if the model is quadratic.
    late: test of forces that act later than assumed, in seconds. Their leanings (18,) are of the logarithms of all
    coefficients, in the order of `OF_HULL`, 0 for those not fitted.
    """

    drag: Tested
    late: Tested

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


def _undragged(drag: Tested, problem: AxisLikelihood) -> Tested:
    """A model that has both dampings lacks none."""
    return replace(drag, score=0.0, size=0.0) if problem.damped == "both" else drag


def _untimed(late: Tested, problem: AxisLikelihood) -> Tested:
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


def _of_all(one: Tested, rows: Sequence[int], where: Sequence[int]) -> Tested:
    leaning = np.zeros(len(OF_HULL))
    leaning[list(rows)] = one.leaning[list(where)]
    return Tested(one.score, one.size, leaning)


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
