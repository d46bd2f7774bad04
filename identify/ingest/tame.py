"""Times that can't be, among many that agree: what a flipped bit leaves, or a vehicle that lies."""

from typing import Final

import numpy as np
from numpy.typing import NDArray

from identify.dive import Array

WILD_S: Final = 60.0
"""By how much a time that differs from those around it can't be one."""
AROUND: Final = 9


def tame(time_s: Array) -> NDArray[np.bool_]:
    """Which of times (n,) in the order of a recording lie where those around put them: a step moves all that follow."""
    if len(time_s) < 2 or not np.abs(np.diff(time_s)).max() > WILD_S:
        return np.ones(len(time_s), np.bool_)
    padded = np.pad(time_s, AROUND // 2, mode="symmetric")
    usual = np.median(np.lib.stride_tricks.sliding_window_view(padded, AROUND), axis=1)
    return np.asarray(np.abs(time_s - usual) <= WILD_S)
