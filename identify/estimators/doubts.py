"""Why an interval might be wrong: a drag that the model lacks, thrust that acts at another time than it says."""

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
    """What speaks against the fit of one axis.

    drag: of a quadratic damping, N/(m/s)^2 or N m/(rad/s)^2, or of a linear one where the model is quadratic. late: of
    seconds by which forces act later than they are taken to. Their leanings (18,) are of the logarithms of all
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
    rows, where = coefficients(joint)
    tested = [_of_all(one, rows, where) for one in with_forces(joint, theta, forces).tested()]
    return {
        problem.axis.dof: Doubts(_undragged(tested[2 * i], problem), _untimed(tested[2 * i + 1], problem))
        for i, problem in enumerate(joint.problems)
    }


def _undragged(drag: Tested, problem: AxisLikelihood) -> Tested:
    """A model that has both dampings lacks none."""
    return replace(drag, score=0.0, size=0.0) if problem.damped == "both" else drag


def _untimed(late: Tested, problem: AxisLikelihood) -> Tested:
    """Slow samples of the commands tell of no lateness."""
    return replace(late, score=0.0, size=0.0) if problem.axis.sampled_s else late


def coefficients(joint: JointLikelihood) -> tuple[list[int], list[int]]:
    """The coefficients that are fitted, as rows of `OF_HULL`, and where theta has them."""
    axes = list(zip(joint.problems, joint.places, strict=True))
    linear = [(6 + one.axis.dof, place.start + DAMPING) for one, place in axes if one.damped != "quadratic"]
    squared = [
        (12 + one.axis.dof, place.start + one.quadratic_place)
        for one, place in axes
        if one.damped != "linear"
    ]
    masses = zip([one.axis.dof for one in joint.problems], joint.mass_places, strict=True)
    rows, where = zip(*masses, *linear, *squared, strict=True)
    return list(rows), list(where)


def _of_all(one: Tested, rows: Sequence[int], where: Sequence[int]) -> Tested:
    leaning = np.zeros(len(OF_HULL))
    leaning[list(rows)] = one.leaning[list(where)]
    return Tested(one.score, one.size, leaning)


def by_drag(speed: Array) -> Array:
    """The force (n,) of a quadratic damping of one at these speeds."""
    return np.asarray(-speed * np.abs(speed))


def lacking_drag(problem: AxisLikelihood, speed: Array) -> Array:
    """The force (n,) at these speeds of a unit of the damping that the model lacks."""
    return -speed if problem.damped == "quadratic" else by_drag(speed)


def simulated_speed(problem: AxisLikelihood, theta: Array) -> Array:
    """Speed (n,) at the events as the model alone gives it from the forces: it shares no noise with the readings."""
    axis = problem.axis
    theta = theta.copy()
    theta[problem.noise_place : problem.white_place] = np.log(DEAF_NOISE)
    error, _ = problem.filtered(theta, np.inf)
    moving = np.isfinite(error) & (axis.state_read != POSITION)
    if not moving.any():
        return problem.means(theta)[:, 0]
    said = ((problem.reading - error) / axis.scale)[moving]
    speed: Array = np.interp(axis.time_s, axis.time_s[moving], said)
    return speed
