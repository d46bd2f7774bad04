"""What a filter's innovations say of the force at every instant: the filter of `own` run backwards.

An innovation is a sum of what pushed before it, so that a force along all of the dive is weighed by one product with
the innovations' own sum of what came after each push (the adjoint; Bryson and Ho 1975, section 13.3). Any number of
forces is then looked through at the price of one.
"""

import numpy as np
from numba import njit
from numpy.typing import NDArray

from identify.diagnose.own import Own
from identify.estimators.innovations import INCREMENT, VELOCITY

Array = NDArray[np.float64]


def scores(own: Own, left: Array) -> Array:
    """(n,): of the mean force in every step of an axis, how much one newton of it goes with rows `left` (rows,)."""
    freed = left.copy()
    for memory in own.memories:
        for lag, share in enumerate(memory.by_lag.tolist(), 1):
            freed[memory.rows[:-lag]] -= share * left[memory.rows[lag:]]
    axis = own.problem.axis
    return np.asarray(_backwards(own.table, axis.step, freed / own.std, own.read, axis.state_read, own.gain))


@njit(cache=True, nogil=True, error_model="numpy")
def _backwards(
    table: Array,
    step: NDArray[np.int64],
    left: Array,
    read: NDArray[np.bool_],
    state_read: NDArray[np.int64],
    gain: Array,
) -> Array:
    """The transpose of `own._answers`, for one column of rows."""
    out = np.zeros(step.shape[0])
    y0, y1, y2 = 0.0, 0.0, 0.0
    row = left.shape[0] - 1
    for i in range(step.shape[0] - 1, -1, -1):
        if state_read[i] == INCREMENT:
            y1 = 0.0
        if read[i]:
            e = left[row] - gain[i, 0] * y0 - gain[i, 1] * y1 - gain[i, 2] * y2
            if state_read[i] == VELOCITY:
                y0 += e
            else:
                y1 += e
            row -= 1
        if step[i] >= 0:
            t = table[step[i]]
            out[i] = (t[7] + t[9]) * y0 + (t[8] + t[10]) * y1
            y0, y1, y2 = (
                t[0] * y0 + t[3] * y1,
                t[1] * y0 + t[4] * y1,
                t[2] * y0 + t[5] * y1 + t[6] * y2,
            )
    return out
