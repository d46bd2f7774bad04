"""Would one more force of a known shape explain more? Asked of a fit without making another.

The Lagrange-multiplier test (Engle 1984, eq. 13): the gradient of the likelihood in the force's size at zero, over the
root of its information with the fitted parameters projected out.
"""

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from identify.estimators.likelihood_axis import FORCES, AxisFit, AxisLikelihood
from identify.estimators.scoring import score

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Tested:
    """By how many standard errors a force's size differs from none; that size, one step of scoring from none; and what
    the fitted parameters (p,) change by with each unit of it."""

    score: float
    size: float
    leaning: Array


@dataclass(frozen=True)
class Wider:
    """The likelihood with one more force beside all else, `start` (p,) the maximum without it, and its place there."""

    problem: AxisLikelihood
    start: Array
    place: int

    def tested(self) -> Tested:
        gradient, information = score(self.problem, self.start)
        information = information + np.diag(self.problem.prior_precision)
        others = np.arange(len(gradient)) != self.place
        cross = information[self.place, others]
        leaning: Array = -np.linalg.solve(information[np.ix_(others, others)], cross)
        left = float(information[self.place, self.place] + cross @ leaning)
        if not left > 0:
            return Tested(0.0, 0.0, 0.0 * leaning)
        pull = float(gradient[self.place])
        return Tested(pull / math.sqrt(left), pull / left, leaning)


def with_force(fit: AxisFit, shape: Array) -> Wider:
    """The fit's likelihood with a force of `shape` (n,) by event, in N or N m for a size of one."""
    problem = fit.problem
    size = max(float(np.sqrt(np.mean(shape**2))), 1e-9)
    place = FORCES + int(problem.shapes.shape[1])
    wider = replace(
        problem,
        shapes=np.column_stack([problem.shapes, shape]),
        prior_mean=np.insert(problem.prior_mean, place, 0.0),
        prior_precision=np.insert(problem.prior_precision, place, 0.0),
        difference=np.insert(problem.difference, place, 1e-3 / size),
    )
    return Wider(wider, np.insert(fit.maximum.theta, place, 0.0), place)
