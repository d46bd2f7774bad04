"""Tests whether one more force of a known shape would improve a fit, without fitting again.

The Lagrange-multiplier test (Engle 1984, eq. 13): the gradient of the likelihood in the force's size at zero, over
the root of its information with the fitted parameters projected out. The gradient of those parameters is projected
out as well (Neyman 1959, C(alpha)), so the fit need only be near its maximum.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from identify.estimators.likelihood_axis import AxisLikelihood
from identify.estimators.likelihood_joint import JointLikelihood

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Tested:
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

    def tested(self) -> tuple[Tested, ...]:
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


def _tested(pull: float, left: float, leaning: Array) -> Tested:
    if not left > 0:
        return Tested(0.0, 0.0, 0.0 * leaning)
    return Tested(pull / math.sqrt(left), pull / left, leaning)
