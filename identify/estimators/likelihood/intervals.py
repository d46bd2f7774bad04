"""Intervals of a fit beyond the information at its maximum: uncertain noise levels, likelihoods that are no parabola.

Fisher information takes the noise levels as known. On a short dive the disturbance is known to some ten per cent, and
its likeliest level is too low. The levels therefore move to their posterior mean, all else integrated out (restricted
maximum likelihood, Harville 1977, section 3, by Laplace's approximation), all other parameters follow, and each
variance becomes its mean over the levels. For a normal sample of n that enlarges the variance of its mean by 1 + 3 / n,
as in Student's distribution.

A 95 % interval ends where the likelihood, maximised over all else, has fallen by 1.96^2 / 2 (Barndorff-Nielsen and Cox
1994, section 3.5): by one scoring step for a coefficient that is known well, by a climb for one known loosely, and
again at twice the distance, as there may be a second summit.

Linear and quadratic damping that a dive can't separate are known in their values, not their logarithms: a normal
distribution truncated to positive values (Johnson, Kotz and Balakrishnan 1994, section 13.10.1).
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bridge.arrays import Array
from identify.estimators.likelihood.axis import DAMPING, DISTURBANCE, TIME_CONSTANT
from identify.estimators.likelihood.joint import JointLikelihood
from identify.estimators.likelihood.scoring import Maximum, Problem, climb, log_posterior
from identify.statistics import Z95

LARGEST_SHIFT = 1.0
"""Largest shift of a noise level, in standard deviations: beyond it the approximation is meaningless."""

LARGEST_LOG_WIDENING = 0.7

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

LOOSE_DRAG = 0.25
"""Standard error of a logarithm above which a drag is stated as a number."""

VAGUE = 2.0
"""Prior standard deviation of a drag, as a share of the start value of its climb."""

SURELY = 5.0
"""Standard errors from 0 beyond which the negative part of a normal distribution is negligible."""


def integrated(joint: JointLikelihood, theta: Array) -> tuple[Array, Array]:
    """Shift to be added to the maximum theta (p,), and factors on its standard deviations (p,)."""
    parts = [joint.score_of(i, theta) for i in range(len(joint.slices))]
    precision = np.diag(joint.prior_precision)
    for indices, _, information in parts:
        precision[np.ix_(indices, indices)] += information
    whole: Array = np.asarray(np.linalg.inv(precision), dtype=np.float64)
    shift, log_widening = np.zeros(len(theta)), np.zeros(len(theta))
    for i, (of_axis, (indices, slope_here, here)) in enumerate(zip(joint.slices, parts, strict=True)):
        levels = [of_axis.start + DISTURBANCE, of_axis.start + TIME_CONSTANT]
        others = np.setdiff1d(np.arange(len(theta)), levels)
        without = precision.copy()
        without[np.ix_(indices, indices)] -= here
        middle = _known(precision, others)[1]
        for step in _directions(whole, levels):
            sides, skewness = [], 0.0
            for sign in (-1.0, 1.0):
                _, slope, there = joint.score_of(i, theta + sign * step)
                moved = without.copy()
                moved[np.ix_(indices, indices)] += there
                sides.append(_known(moved, others))
                skewness += float(step[indices] @ (slope - slope_here))
            (down, low), (up, high) = sides
            mean = float(np.clip(0.5 * skewness - 0.25 * (up - down), -LARGEST_SHIFT, LARGEST_SHIFT))
            tilt, bend = 0.5 * (high - low), 0.5 * (high + low) - middle
            shift += mean * step
            log_widening[others] += tilt * mean + 0.5 * tilt**2 + bend * (1.0 + mean**2)
    return shift, np.exp(0.5 * np.clip(log_widening, 0.0, LARGEST_LOG_WIDENING))


def _directions(covariance: Array, levels: list[int]) -> Iterator[Array]:
    """Changes of theta (p,) by one standard deviation of its noise `levels`, uncorrelated with one another.

    All other parameters follow as far as they are correlated with the levels.
    """
    spread, axes = np.linalg.eigh(covariance[np.ix_(levels, levels)])
    for variance, axis in zip(spread, axes.T, strict=True):
        yield covariance[:, levels] @ axis / np.sqrt(variance)


def _known(precision: Array, others: NDArray[np.intp]) -> tuple[float, Array]:
    """Log determinant of the precision of `rest`, and the log variances (k,), given the levels."""
    block = precision[np.ix_(others, others)]
    return float(np.linalg.slogdet(block)[1]), np.log(np.diag(np.linalg.inv(block)))


@dataclass(frozen=True)
class Pinned:
    """A problem with one of its parameters fixed."""

    problem: Problem
    index: int
    at: float

    @property
    def difference(self) -> Array:
        return self.problem.difference

    @property
    def prior_mean(self) -> Array:
        mean = self.problem.prior_mean.copy()
        mean[self.index] = self.at
        return mean

    @property
    def prior_precision(self) -> Array:
        precision = self.problem.prior_precision.copy()
        precision[self.index] = PIN
        return precision

    def log_likelihood(self, theta: Array) -> float:
        return self.problem.log_likelihood(theta)

    def score(self, theta: Array) -> tuple[Array, Array]:
        return self.problem.score(theta)


def stretches(problem: Problem, maximum: Array, index: int) -> tuple[float, float]:
    """Factors on the lower and the upper half of a parameter's interval.

    `maximum` (p,) is the maximum of the posterior.
    """
    _, information = problem.score(maximum)
    covariance = np.linalg.inv(information + np.diag(problem.prior_precision))
    std = float(np.sqrt(covariance[index, index]))
    step: Array = np.asarray(Z95 * covariance[:, index] / std, dtype=np.float64)
    top = float(log_posterior(problem, maximum))
    way = _searched if LOOSE < std < HOPELESS else _stretch
    below, above = (way(problem, maximum, sign * step, index, top) for sign in (-1.0, 1.0))
    return below, above


def _stretch(problem: Problem, maximum: Array, step: Array, index: int, top: float) -> float:
    end = maximum + step
    try:
        gradient, information = problem.score(end)
    except np.linalg.LinAlgError:
        # The parabola of a hopeless parameter may end where the equations have no solution.
        return FURTHEST
    others = np.arange(len(end)) != index
    slope = (gradient - problem.prior_precision * (end - problem.prior_mean))[others]
    precision = (information + np.diag(problem.prior_precision))[np.ix_(others, others)]
    # Far out on a hopeless parameter the information may be singular but for rounding: nothing is regained there.
    scale = np.sqrt(np.maximum(np.diag(precision), 1e-300))
    inverse = np.linalg.pinv(precision / np.outer(scale, scale), hermitian=True)
    regained = 0.5 * float((slope / scale) @ inverse @ (slope / scale))
    fallen = max(top - log_posterior(problem, end) - regained, 0.0)
    return float(np.clip(Z95 / np.sqrt(2.0 * fallen + 1e-12), NEAREST, FURTHEST))


def _searched(problem: Problem, maximum: Array, step: Array, index: int, top: float) -> float:
    def root_of_fall(far: float) -> float:
        """Root of twice the fall at `far` times the distance of the parabola's end: 1.96 `far` on a parabola."""
        end = maximum + far * step
        held = Pinned(problem, index, float(end[index]))
        best = climb(held, end, NEARLY).theta
        return float(np.sqrt(2.0 * max(top - log_posterior(problem, best), 0.0)))

    near, far = root_of_fall(1.0), root_of_fall(2.0)
    if near >= Z95:
        first = Z95 / near
    else:
        first = ENDLESS if far <= Z95 else 1.0 + (Z95 - near) / (far - near)
    tail = 2.0 * Z95 / max(far, 1e-6)
    return float(np.clip(tail if tail > LONG_TAIL * first else first, NEAREST, ENDLESS))


@dataclass(frozen=True)
class JointKnowledge:
    """Knowledge of a fit's theta: its `middle` (p,) and `covariance` (p, p). For the drags at the indices in
    `stretch` these are the logarithm of the mean and the relative covariance; `stretch` holds factors on the lower
    and the upper half of their intervals."""

    middle: Array
    covariance: Array
    stretch: dict[int, tuple[float, float]]


def knowledge_of(joint: JointLikelihood, maximum: Maximum) -> JointKnowledge:
    """Return the knowledge of all axes; drags that are known loosely are treated as numbers."""
    whole: Array = np.asarray(np.linalg.inv(maximum.precision), dtype=np.float64)
    loose = _loose(joint, np.sqrt(np.diag(whole)))
    return _as_numbers(joint, maximum.theta, loose) if loose else JointKnowledge(maximum.theta, whole, {})


def _loose(joint: JointLikelihood, std: Array) -> list[int]:
    """Indices in theta of linear and quadratic damping, for axes in which either is known loosely; std (p,)."""
    indices: list[int] = []
    for problem, of_axis in zip(joint.problems, joint.slices, strict=True):
        both = [of_axis.start + DAMPING, of_axis.start + problem.quadratic_index]
        if problem.damped == "both" and np.max(std[both]) > LOOSE_DRAG:
            indices += both
    return indices


def _as_numbers(joint: JointLikelihood, theta: Array, at: list[int]) -> JointKnowledge:
    gradient, information = joint.score(theta)
    prior_mean, precision = joint.prior_mean.copy(), joint.prior_precision.copy()
    value, unit = theta.copy(), np.ones(len(theta))
    value[at] = unit[at] = np.exp(theta[at])
    prior_mean[at] = np.exp(prior_mean[at])
    precision[at] = (VAGUE * prior_mean[at]) ** -2.0
    covariance: Array = np.asarray(np.linalg.inv(information / np.outer(unit, unit) + np.diag(precision)))
    mean = value + covariance @ (gradient / unit - precision * (value - prior_mean))
    ends = {}
    # The least certain damping first, because the other follows it.
    for index in sorted(at, key=lambda index: mean[index] / np.sqrt(covariance[index, index])):
        ends[index] = _interval(float(mean[index]), float(np.sqrt(covariance[index, index])))
        mean, covariance = _without_negative(mean, covariance, index)
    unit[at] = mean[at]
    middle, relative = mean.copy(), covariance / np.outer(unit, unit)
    middle[at] = np.log(mean[at])
    half = {index: Z95 * float(np.sqrt(relative[index, index])) for index in at}
    # An interval may begin at zero, which has no logarithm.
    with np.errstate(divide="ignore"):
        stretch = {
            index: (
                float(np.log(mean[index] / low)) / half[index],
                float(np.log(high / mean[index])) / half[index],
            )
            for index, (low, high) in ends.items()
        }
    return JointKnowledge(middle, relative, stretch)


def _interval(middle: float, std: float) -> tuple[float, float]:
    """95 % interval of a normal distribution truncated to positive values; it starts at 0 if zero is plausible."""
    from scipy.special import (
        log_ndtr,
        ndtri_exp,
    )  # here, because its import takes 0.15 s and few drags need it

    # In logarithms, because far out on the negative side the remaining probability would be rounded away.
    left = float(log_ndtr(middle / std))
    low, high = (middle - std * float(ndtri_exp(left + np.log(share))) for share in (0.975, 0.025))
    return (0.0 if middle < Z95 * std else low), high


def _without_negative(mean: Array, covariance: Array, index: int) -> tuple[Array, Array]:
    """Mean (p,) and covariance (p, p) once the parameter at `index` can't be negative."""
    std = float(np.sqrt(covariance[index, index]))
    off = float(mean[index]) / std
    if off > SURELY:
        return mean, covariance
    from scipy.special import log_ndtr

    # The hazard of a normal distribution, in logarithms for the far side.
    hazard = float(np.exp(-0.5 * off**2 - 0.5 * np.log(2.0 * np.pi) - log_ndtr(off)))
    left = max(1.0 - hazard * (hazard + off), 1e-6)
    along: Array = covariance[:, index] / std
    return mean + along * hazard, covariance - np.outer(along, along) * (1.0 - left)
