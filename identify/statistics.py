"""Figures of samples that several judgements share: 95 % intervals, spreads that outliers leave alone, residuals."""

import numpy as np
from numpy.typing import NDArray

from bridge.wire.clock_line import NORMAL

Array = NDArray[np.float64]

Z95 = 1.959963984540054
"""Half the width of a normal distribution's 95 % interval, in standard deviations."""


def bulk_std(left: Array) -> float:
    """Standard deviation of the normal bulk of residuals, from the median of their sizes."""
    return NORMAL * float(np.median(np.abs(left)))


def spread(value: Array) -> float:
    """Standard deviation of the normal bulk of the values, from the median absolute deviation."""
    return bulk_std(value - np.median(value))


def left_of(columns: Array, value: Array) -> Array:
    """Residual of a value, (n,) or (n, k), after a least-squares fit of the columns of `columns`."""
    fitted, *_ = np.linalg.lstsq(columns, value, rcond=None)
    return np.asarray(value - columns @ fitted)
