"""What innovations remember of those before: a disturbance that is not of first order leaves some of it.

Where they remember nothing this takes nothing away; where they do, standard errors that took them for independent
would be too small, and the first slow effect that comes by would seem to explain them (Klein and Morelli 2016, section
5.3, on coloured residuals). A regression of each channel's innovations on its own ORDER before frees both sides of it.
"""

from dataclasses import dataclass

import numpy as np
from numba import njit
from numpy.typing import NDArray

Array = NDArray[np.float64]

ORDER = 10
LEAST_ROWS = 20 * ORDER

NARROW = 4
"""Up to so many columns each is freed by itself; more of them go quicker side by side."""


@dataclass(frozen=True)
class Memory:
    """Of one channel: its `rows` (m,) in the order of time, and what a row takes from those before, nearest first."""

    rows: NDArray[np.intp]
    by_lag: Array

    def freed(self, values: Array) -> None:
        """Take out of values (n, k), in place, what the channel's rows remember; the first few stay as they are."""
        if values.shape[1] > NARROW:
            _freed(values, self.rows, self.by_lag)
        else:
            _each_freed(values, self.rows, self.by_lag)


@njit(cache=True, nogil=True)
def _freed(values: Array, rows: NDArray[np.intp], by_lag: Array) -> None:
    """From the last row back, so that what is taken is of rows that still hold it."""
    width = values.shape[1]
    left = np.empty(width)
    for k in range(len(rows) - 1, -1, -1):
        own = values[rows[k]]
        left[:] = own
        for lag in range(1, min(len(by_lag), k) + 1):
            share, before = by_lag[lag - 1], values[rows[k - lag]]
            for c in range(width):
                left[c] -= share * before[c]
        own[:] = left


@njit(cache=True, nogil=True)
def _each_freed(values: Array, rows: NDArray[np.intp], by_lag: Array) -> None:
    """The same, lag by lag, for the processor to take several rows of a column at once."""
    count = len(rows)
    own, left = np.empty(count), np.empty(count)
    for c in range(values.shape[1]):
        for k in range(count):
            own[k] = values[rows[k], c]
        left[:] = own
        for lag in range(1, len(by_lag) + 1):
            share = by_lag[lag - 1]
            for k in range(lag, count):
                left[k] -= share * own[k - lag]
        for k in range(count):
            values[rows[k], c] = left[k]


def memory_of(rows: NDArray[np.intp], innovations: Array) -> Memory:
    """The memory that `innovations` (n,) have in some rows, by Yule and Walker's equations; none where they are few."""
    own = innovations[rows]
    if len(own) < LEAST_ROWS:
        return Memory(rows, np.zeros(0))
    own = own - own.mean()
    products = np.array([float(own[lag:] @ own[: len(own) - lag]) for lag in range(ORDER + 1)])
    table = products[np.abs(np.subtract.outer(np.arange(ORDER), np.arange(ORDER)))]
    return Memory(rows, np.asarray(np.linalg.solve(table, products[1:])))
