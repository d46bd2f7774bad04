"""Effect of the noise levels' own uncertainty on all other parameters.

Fisher information at the most likely noise levels takes those levels as known. They are not: on a short dive the
disturbance is known to some ten per cent, and the most likely level is too low, because the fitted forces have
explained part of it away, and because larger levels are less unlikely than smaller ones. Both effects are corrected
to second order about the maximum. The levels move to their posterior mean, all else integrated out (restricted
maximum likelihood, Harville 1977, section 3, by Laplace's approximation; the skewness from the slope on both sides);
all other parameters follow; and each variance becomes its mean over the levels. For a normal sample of n this
enlarges the variance of its mean by 1 + 3 / n, as in Student's distribution.
"""

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from identify.estimators.likelihood_axis import DISTURBANCE, TIME_CONSTANT
from identify.estimators.likelihood_joint import JointLikelihood

Array = NDArray[np.float64]

LARGEST_SHIFT = 1.0
"""Largest shift of a noise level, in standard deviations: beyond it the approximation is meaningless."""

LARGEST_LOG_WIDENING = 0.7


def integrated(joint: JointLikelihood, theta: Array) -> tuple[Array, Array]:
    """Shift to be added to the maximum theta (p,), and factors on its standard deviations (p,)."""
    parts = [joint.score_of(i, theta) for i in range(len(joint.places))]
    precision = np.diag(joint.prior_precision)
    for places, _, information in parts:
        precision[np.ix_(places, places)] += information
    whole: Array = np.asarray(np.linalg.inv(precision), dtype=np.float64)
    shift, log_widening = np.zeros(len(theta)), np.zeros(len(theta))
    for i, (place, (places, slope_here, here)) in enumerate(zip(joint.places, parts, strict=True)):
        levels = [place.start + DISTURBANCE, place.start + TIME_CONSTANT]
        others = np.setdiff1d(np.arange(len(theta)), levels)
        without = precision.copy()
        without[np.ix_(places, places)] -= here
        middle = _known(precision, others)[1]
        for step in _directions(whole, levels):
            sides, skewness = [], 0.0
            for sign in (-1.0, 1.0):
                _, slope, there = joint.score_of(i, theta + sign * step)
                moved = without.copy()
                moved[np.ix_(places, places)] += there
                sides.append(_known(moved, others))
                skewness += float(step[places] @ (slope - slope_here))
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


def _known(precision: Array, rest: NDArray[np.intp]) -> tuple[float, Array]:
    """Log determinant of the precision of `rest`, and the log variances (k,), given the levels."""
    block = precision[np.ix_(rest, rest)]
    return float(np.linalg.slogdet(block)[1]), np.log(np.diag(np.linalg.inv(block)))
