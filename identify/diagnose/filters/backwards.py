"""The filters run backwards: what each instant of a force would change of the likelihood of their innovations."""

import numpy as np
from numba import njit
from numpy.typing import NDArray

from bridge.arrays import Array
from identify.diagnose.filters.innovations import AxisInnovations
from identify.estimators.filter.state import INCREMENT, NO_STEP, VELOCITY


def scores(innovations: AxisInnovations, left: Array) -> Array:
    """Derivative (n,) of the log likelihood of rows `left` (rows,) by the mean force of each step."""
    return scores_of_each(innovations, left[:, None])[:, 0]


def scores_of_each(innovations: AxisInnovations, left: Array) -> Array:
    """The same (n, k) of several columns of rows `left` (rows, k)."""
    left = np.ascontiguousarray(left)
    freed = left.copy()
    for autoregression in innovations.autoregressions:
        _free(freed, left, autoregression.rows, autoregression.by_lag)
    freed /= innovations.std[:, None]
    axis = innovations.problem.axis
    return np.asarray(
        _backwards(
            innovations.table,
            innovations.problem.step,
            freed,
            innovations.read,
            axis.state_read,
            innovations.gain,
            axis.is_coloured,
        )
    )


@njit(cache=True, nogil=True)
def _free(freed: Array, left: Array, rows: NDArray[np.intp], by_lag: Array) -> None:
    """Take an autoregression of some rows off `left`, as the transpose of its prewhitening does."""
    for k in range(len(rows)):
        for lag in range(1, min(len(by_lag), len(rows) - 1 - k) + 1):
            share, later = by_lag[lag - 1], rows[k + lag]
            for c in range(left.shape[1]):
                freed[rows[k], c] -= share * left[later, c]


@njit(cache=True, nogil=True, error_model="numpy")
def _backwards(
    table: Array,
    step: NDArray[np.int64],
    left: Array,
    read: NDArray[np.bool_],
    state_read: NDArray[np.int64],
    gain: Array,
    coloured: bool,
) -> Array:
    """The transpose of `estimators.filter.innovations.responses`: columns (n, k) of those of rows (rows, k), computed
    together for vectorisation."""
    count = left.shape[1]
    out = np.zeros((step.shape[0], count))
    y0, y1, y2, y3 = np.zeros(count), np.zeros(count), np.zeros(count), np.zeros(count)
    row = left.shape[0] - 1
    for i in range(step.shape[0] - 1, -1, -1):
        if state_read[i] == INCREMENT:
            y1[:] = 0.0
        if read[i]:
            k0, k1, k2, k3 = gain[i, 0], gain[i, 1], gain[i, 2], gain[i, 3]
            velocity = state_read[i] == VELOCITY
            error = 1.0 if velocity and coloured else 0.0
            for c in range(count):
                e = left[row, c] - k0 * y0[c] - k1 * y1[c] - k2 * y2[c] - k3 * y3[c]
                if velocity:
                    y0[c] += e
                    y3[c] += error * e
                else:
                    y1[c] += e
            row -= 1
        if step[i] >= 0:
            t = table[step[i]]
            t0, t1, t2, t3, t4, t5, t6 = t[0], t[1], t[2], t[3], t[4], t[5], t[6]
            t33, t03, t13, t23, t32 = t[17], t[19], t[20], t[21], t[22]
            by_nu, by_x = t[7] + t[9], t[8] + t[10]
            for c in range(count):
                a, b, d, s = y0[c], y1[c], y2[c], y3[c]
                out[i, c] = by_nu * a + by_x * b
                y0[c] = t0 * a + t3 * b
                y1[c] = t1 * a + t4 * b
                y2[c] = t2 * a + t5 * b + t6 * d + t32 * s
                y3[c] = t03 * a + t13 * b + t23 * d + t33 * s
        elif step[i] < NO_STEP:
            y0[:], y1[:], y2[:], y3[:] = 0.0, 0.0, 0.0, 0.0
    return out
