"""The filters run backwards: what each instant of a force would change of the likelihood of their innovations."""

import numpy as np
from numba import njit
from numpy.typing import NDArray

from bridge.arrays import Array
from identify.diagnose.filters.innovations import AxisInnovations
from identify.estimators.filter.state import INCREMENT, NO_STEP, VELOCITY


def scores(innovations: AxisInnovations, left: Array) -> Array:
    """Derivative (n,) of the log likelihood of rows `left` (rows,) by the mean force of each step."""
    freed = left.copy()
    for autoregression in innovations.autoregressions:
        for lag, share in enumerate(autoregression.by_lag.tolist(), 1):
            freed[autoregression.rows[:-lag]] -= share * left[autoregression.rows[lag:]]
    axis = innovations.problem.axis
    return np.asarray(
        _backwards(
            innovations.table,
            innovations.problem.step,
            freed / innovations.std,
            innovations.read,
            axis.state_read,
            innovations.gain,
            axis.is_coloured,
        )
    )


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
    """The transpose of `estimators.filter.innovations.responses`, for one column of rows."""
    out = np.zeros(step.shape[0])
    y0, y1, y2, y3 = 0.0, 0.0, 0.0, 0.0
    row = left.shape[0] - 1
    for i in range(step.shape[0] - 1, -1, -1):
        if state_read[i] == INCREMENT:
            y1 = 0.0
        if read[i]:
            e = left[row] - gain[i, 0] * y0 - gain[i, 1] * y1 - gain[i, 2] * y2 - gain[i, 3] * y3
            if state_read[i] != VELOCITY:
                y1 += e
            else:
                y0 += e
                if coloured:
                    y3 += e
            row -= 1
        if step[i] >= 0:
            t = table[step[i]]
            out[i] = (t[7] + t[9]) * y0 + (t[8] + t[10]) * y1
            y0, y1, y2, y3 = (
                t[0] * y0 + t[3] * y1,
                t[1] * y0 + t[4] * y1,
                t[2] * y0 + t[5] * y1 + t[6] * y2 + t[22] * y3,
                t[19] * y0 + t[20] * y1 + t[21] * y2 + t[17] * y3,
            )
        elif step[i] < NO_STEP:
            y0, y1, y2, y3 = 0.0, 0.0, 0.0, 0.0
    return out
