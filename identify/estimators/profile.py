"""Interval of a coefficient on either side, if the likelihood is not a parabola.

A 95 % interval ends where the likelihood, maximised over all else, has fallen by 1.96^2 / 2 (Barndorff-Nielsen and
Cox 1994, section 3.5). For a coefficient that is known well, one scoring step of all other parameters gives the fall
at the parabola's end; to first order, the true end is further out by a factor of 1.96 over the root of twice the
fall. For a coefficient that is known loosely, all other parameters are climbed there, and again at twice the
distance: there may be a second summit next to the first.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from identify.estimators.likelihood_joint import alone
from identify.estimators.scoring import Problem, Score, climb, log_posterior
from identify.identification import Z95

Array = NDArray[np.float64]

NEAREST, FURTHEST = 0.7, 2.0
"""Smallest and largest factor on the parabola's end that is accepted."""

ENDLESS = 4.0
"""Factor for an end that is not reached even at twice the parabola's end."""

LOOSE, HOPELESS = 0.1, 0.3
"""Range of standard errors, of logarithms, in which all other parameters are climbed."""

LONG_TAIL = 1.2
"""If the parabola through the fall at twice the end is wider by this factor, its width replaces the nearer end."""

NEARLY = 0.05
"""Convergence limit, in nats, of the climb of all other parameters."""

PIN = 1e9


@dataclass(frozen=True)
class Pinned:
    """A problem with one of its parameters fixed."""

    problem: Problem
    place: int
    at: float

    @property
    def difference(self) -> Array:
        return self.problem.difference

    @property
    def prior_mean(self) -> Array:
        mean = self.problem.prior_mean.copy()
        mean[self.place] = self.at
        return mean

    @property
    def prior_precision(self) -> Array:
        precision = self.problem.prior_precision.copy()
        precision[self.place] = PIN
        return precision

    def innovations(self, theta: Array) -> tuple[Array, Array]:
        return self.problem.innovations(theta)

    def log_likelihood(self, theta: Array) -> float:
        return self.problem.log_likelihood(theta)


def stretches(problem: Problem, maximum: Array, place: int, score: Score = alone) -> tuple[float, float]:
    """Factors on the lower and the upper half of a parameter's interval.

    `maximum` (p,) is the maximum of the posterior.
    """
    _, information = score(problem, maximum)
    covariance = np.linalg.inv(information + np.diag(problem.prior_precision))
    std = float(np.sqrt(covariance[place, place]))
    step: Array = np.asarray(Z95 * covariance[:, place] / std, dtype=np.float64)
    top = float(log_posterior(problem, maximum))
    way = _searched if LOOSE < std < HOPELESS else _stretch
    below, above = (way(problem, maximum, sign * step, place, top, score) for sign in (-1.0, 1.0))
    return below, above


def _stretch(problem: Problem, maximum: Array, step: Array, place: int, top: float, score: Score) -> float:
    end = maximum + step
    gradient, information = score(problem, end)
    others = np.arange(len(end)) != place
    slope = (gradient - problem.prior_precision * (end - problem.prior_mean))[others]
    precision = (information + np.diag(problem.prior_precision))[np.ix_(others, others)]
    # Far out on a hopeless parameter the information may be singular but for rounding: nothing is regained there.
    scale = np.sqrt(np.maximum(np.diag(precision), 1e-300))
    inverse = np.linalg.pinv(precision / np.outer(scale, scale), hermitian=True)
    regained = 0.5 * float((slope / scale) @ inverse @ (slope / scale))
    fallen = max(top - log_posterior(problem, end) - regained, 0.0)
    return float(np.clip(Z95 / np.sqrt(2.0 * fallen + 1e-12), NEAREST, FURTHEST))


def _searched(problem: Problem, maximum: Array, step: Array, place: int, top: float, score: Score) -> float:
    def root_of_fall(far: float) -> float:
        """Root of twice the fall at `far` times the distance of the parabola's end: 1.96 `far` on a parabola."""
        end = maximum + far * step
        held = Pinned(problem, place, float(end[place]))
        best = climb(held, end, NEARLY, lambda _, theta: score(problem, theta)).theta
        return float(np.sqrt(2.0 * max(top - log_posterior(problem, best), 0.0)))

    near, far = root_of_fall(1.0), root_of_fall(2.0)
    if near >= Z95:
        first = Z95 / near
    else:
        first = ENDLESS if far <= Z95 else 1.0 + (Z95 - near) / (far - near)
    tail = 2.0 * Z95 / max(far, 1e-6)
    return float(np.clip(tail if tail > LONG_TAIL * first else first, NEAREST, ENDLESS))
