"""How far the likelihood lets a coefficient go on either side, where it is no parabola.

The end of a 95 % interval is where the likelihood, all else at its best, has fallen by 1.96^2 / 2 (Barndorff-Nielsen
and Cox 1994, section 3.5). At the end that the parabola gives, one scoring step of all else tells how far it has
fallen there; how much nearer or further the true end lies is 1.96 over the fall's root, to first order.
"""

import numpy as np
from numpy.typing import NDArray

from identify.estimators.likelihood_joint import alone
from identify.estimators.scoring import Problem, Score, log_posterior
from identify.identification import Z95

Array = NDArray[np.float64]

NEAREST, FURTHEST = 0.7, 2.0
"""Shares of the parabola's end that are believed."""


def stretches(problem: Problem, maximum: Array, place: int, score: Score = alone) -> tuple[float, float]:
    """What to multiply the lower and the upper half of a parameter's interval by.

    `maximum` (p,) is the posterior's own.
    """
    _, information = score(problem, maximum)
    covariance = np.linalg.inv(information + np.diag(problem.prior_precision))
    step = Z95 * covariance[:, place] / np.sqrt(covariance[place, place])
    top = log_posterior(problem, maximum)
    below, above = (_stretch(problem, maximum + sign * step, place, top, score) for sign in (-1.0, 1.0))
    return below, above


def _stretch(problem: Problem, end: Array, place: int, top: float, score: Score) -> float:
    gradient, information = score(problem, end)
    others = np.arange(len(end)) != place
    slope = (gradient - problem.prior_precision * (end - problem.prior_mean))[others]
    precision = (information + np.diag(problem.prior_precision))[np.ix_(others, others)]
    regained = 0.5 * float(slope @ np.linalg.solve(precision, slope))
    fallen = max(top - log_posterior(problem, end) - regained, 0.0)
    return float(np.clip(Z95 / np.sqrt(2.0 * fallen + 1e-12), NEAREST, FURTHEST))
