"""How far the likelihood lets a coefficient go on either side, where it is no parabola.

The end of a 95 % interval is where the likelihood, all else at its best, has fallen by 1.96^2 / 2 (Barndorff-Nielsen
and Cox 1994, section 3.5). Of a coefficient that is known well, one scoring step of all else tells how far it has
fallen at the end that the parabola gives; how much nearer or further the true end lies is 1.96 over the fall's root, to
first order. Of one that is known loosely, all else is climbed there and once more as far again: a second summit may
stand beside the first.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from identify.estimators.likelihood_joint import alone
from identify.estimators.scoring import Problem, Score, climb, log_posterior
from identify.identification import Z95

Array = NDArray[np.float64]

NEAREST, FURTHEST = 0.7, 2.0
"""Shares of the parabola's end that are believed."""

ENDLESS = 4.0
"""Of an end that even twice the parabola's does not reach."""

LOOSE, HOPELESS = 0.1, 0.3
"""Standard errors, of logarithms, from which on and up to which all else is climbed."""

LONG_TAIL = 1.2
"""Where the parabola that falls as little at twice the end is so much wider, its width tells what lies beyond."""

NEARLY = 0.05
"""Nats: as far as all else is climbed."""

PIN = 1e9


@dataclass(frozen=True)
class Pinned:
    """A problem with one of its parameters held where it is."""

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


def stretches(problem: Problem, maximum: Array, place: int, score: Score = alone) -> tuple[float, float]:
    """What to multiply the lower and the upper half of a parameter's interval by.

    `maximum` (p,) is the posterior's own.
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
    regained = 0.5 * float(slope @ np.linalg.solve(precision, slope))
    fallen = max(top - log_posterior(problem, end) - regained, 0.0)
    return float(np.clip(Z95 / np.sqrt(2.0 * fallen + 1e-12), NEAREST, FURTHEST))


def _searched(problem: Problem, maximum: Array, step: Array, place: int, top: float, score: Score) -> float:
    def root_of_fall(far: float) -> float:
        """The root of twice the fall, `far` times the parabola's end away: 1.96 `far` on a parabola."""
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
