"""Figures of samples that several judgements share: 95 % intervals, spreads that outliers leave alone, residuals."""

import math

import numpy as np

from bridge.arrays import Array
from bridge.wire.clock_line import NORMAL

Z95 = 1.959963984540054
"""Half the width of a normal distribution's 95 % interval, in standard deviations."""


def wilson(share: float, count: float) -> tuple[float, float]:
    """The 95 % bounds of a share of `count` independent cases (Wilson 1927)."""
    spread = Z95**2 / count
    middle = (share + spread / 2) / (1 + spread)
    half = Z95 * math.sqrt(share * (1 - share) / count + spread / (4 * count)) / (1 + spread)
    return max(middle - half, 0.0), min(middle + half, 1.0)


def bulk_std(left: Array) -> float:
    """Standard deviation of the normal bulk of residuals, from the median of their sizes."""
    return NORMAL * float(np.median(np.abs(left)))


def spread(value: Array) -> float:
    """Standard deviation of the normal bulk of the values, from the median absolute deviation."""
    return bulk_std(value - np.median(value))


def birge_mean(value: Array, covariance: Array) -> tuple[float, float]:
    """Mean of values (n,) by generalised least squares, and its standard error.

    Where the values disagree beyond their `covariance` (n, n), the error grows by as much (Birge 1932).
    """
    weight = np.linalg.solve(covariance, np.ones(len(value)))
    mean = float(weight @ value / weight.sum())
    off = value - mean
    beyond = float(off @ np.linalg.solve(covariance, off)) / max(len(value) - 1, 1)
    return mean, math.sqrt(max(beyond, 1.0) / float(weight.sum()))


def left_of(columns: Array, value: Array) -> Array:
    """Residual of a value, (n,) or (n, k), after a least-squares fit of the columns of `columns`."""
    fitted, *_ = np.linalg.lstsq(columns, value, rcond=None)
    return np.asarray(value - columns @ fitted)


def covariance_of_sum(rows: Array, lags: int) -> Array:
    """Covariance (p, p) of the sum of rows (n, p) that are correlated with those less than `lags` later (Newey and
    West 1987)."""
    total = rows.T @ rows
    for k in range(1, min(lags, len(rows))):
        apart = (1 - k / lags) * rows[k:].T @ rows[:-k]
        total += apart + apart.T
    return np.asarray(total)
