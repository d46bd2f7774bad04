"""What the noise levels' own uncertainty does to all else.

Fisher information at the most likely noise levels takes those for granted. They are not: on a short dive the
disturbance is known to some ten percent, and the most likely level is too low: by what the fitted forces have explained
away, and because larger levels are less unlikely than smaller ones. Both are mended to second order about the maximum:
the levels move to the mean of what they may be, all else integrated out (restricted maximum likelihood, Harville 1977,
section 3, by Laplace's approximation; the skewness from the slope on both sides), all else follows, and each variance
becomes its mean over the levels. Of a normal sample of n that makes the variance of its mean larger by 1 + 3 / n, which
is Student's.
"""

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from identify.estimators.likelihood_axis import DISTURBANCE, TIME_CONSTANT
from identify.estimators.likelihood_joint import JointLikelihood

Array = NDArray[np.float64]

LARGEST_SHIFT = 1.0
"""Noise levels are moved by no more than this, in standard deviations: further off the approximation means nothing."""

LARGEST_LOG_WIDENING = 0.7


def integrated(joint: JointLikelihood, theta: Array) -> tuple[Array, Array]:
    """What to add to the maximum theta (p,), and what to multiply its standard deviations by (p,)."""
    parts = [joint.score_of(i, theta) for i in range(len(joint.places))]
    precision = np.diag(joint.prior_precision)
    for where, _, information in parts:
        precision[np.ix_(where, where)] += information
    whole: Array = np.asarray(np.linalg.inv(precision), dtype=np.float64)
    shift, log_widening = np.zeros(len(theta)), np.zeros(len(theta))
    for i, (place, (where, slope_here, here)) in enumerate(zip(joint.places, parts, strict=True)):
        levels = [place.start + DISTURBANCE, place.start + TIME_CONSTANT]
        rest = np.setdiff1d(np.arange(len(theta)), levels)
        without = precision.copy()
        without[np.ix_(where, where)] -= here
        middle = _known(precision, rest)[1]
        for step in _directions(whole, levels):
            sides, skewness = [], 0.0
            for sign in (-1.0, 1.0):
                _, slope, there = joint.score_of(i, theta + sign * step)
                moved = without.copy()
                moved[np.ix_(where, where)] += there
                sides.append(_known(moved, rest))
                skewness += float(step[where] @ (slope - slope_here))
            (down, low), (up, high) = sides
            mean = float(np.clip(0.5 * skewness - 0.25 * (up - down), -LARGEST_SHIFT, LARGEST_SHIFT))
            tilt, bend = 0.5 * (high - low), 0.5 * (high + low) - middle
            shift += mean * step
            log_widening[rest] += tilt * mean + 0.5 * tilt**2 + bend * (1.0 + mean**2)
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
