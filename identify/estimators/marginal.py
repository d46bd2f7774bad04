"""What the noise levels' own uncertainty does to all else.

Fisher information at the most likely noise levels takes those for granted. They are not: on a short dive the
disturbance is known to some ten percent, and the most likely level is too low by what the fitted forces have explained
away. Both are mended to second order about the maximum: the levels move to where the likelihood with all else
integrated out is greatest (restricted maximum likelihood, Harville 1977, section 3, by Laplace's approximation), all
else follows, and each variance becomes its mean over what the levels may be.
"""

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from identify.estimators.likelihood_axis import DISTURBANCE, TIME_CONSTANT
from identify.estimators.likelihood_joint import JointLikelihood
from identify.estimators.scoring import Maximum

Array = NDArray[np.float64]

LARGEST_SHIFT = 1.0
"""Noise levels are moved by no more than this, in standard deviations: further off the approximation means nothing."""

LARGEST_LOG_WIDENING = 0.7


def integrated(joint: JointLikelihood, maximum: Maximum) -> tuple[Array, Array]:
    """What to add to theta (p,), and what to multiply its standard deviations by (p,)."""
    whole = np.asarray(np.linalg.inv(maximum.precision), dtype=np.float64)
    shift, log_widening = np.zeros(len(whole)), np.zeros(len(whole))
    for i, place in enumerate(joint.places):
        levels = [place.start + DISTURBANCE, place.start + TIME_CONSTANT]
        rest = np.setdiff1d(np.arange(len(whole)), levels)
        here = joint.score_of(i, maximum.theta)[2]
        middle = _known(maximum.precision, rest)
        for step in _directions(whole, levels):
            sides = []
            for sign in (-1.0, 1.0):
                where, _, there = joint.score_of(i, maximum.theta + sign * step)
                precision = maximum.precision.copy()
                precision[np.ix_(where, where)] += there - here
                sides.append(_known(precision, rest))
            (down, low), (up, high) = sides
            moved = float(np.clip(-0.25 * (up - down), -LARGEST_SHIFT, LARGEST_SHIFT))
            slope, bend = 0.5 * (high - low), 0.5 * (high + low) - middle[1]
            shift += moved * step
            log_widening[rest] += slope * moved + 0.5 * slope**2 + bend * (1.0 + moved**2)
    return shift, np.exp(0.5 * np.clip(log_widening, 0.0, LARGEST_LOG_WIDENING))


def _directions(covariance: Array, levels: list[int]) -> Iterator[Array]:
    """Changes of theta (p,) by one standard deviation of its noise `levels`, uncorrelated with one another.

    All else follows as far as it is correlated with them.
    """
    spread, axes = np.linalg.eigh(covariance[np.ix_(levels, levels)])
    for variance, axis in zip(spread, axes.T, strict=True):
        yield covariance[:, levels] @ axis / np.sqrt(variance)


def _known(precision: Array, rest: NDArray[np.intp]) -> tuple[float, Array]:
    """The log determinant of the precision of `rest`, and the log variances (k,), the levels given."""
    own = precision[np.ix_(rest, rest)]
    return float(np.linalg.slogdet(own)[1]), np.log(np.diag(np.linalg.inv(own)))
