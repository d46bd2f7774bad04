"""Finds impossible times among many that agree: the effect of a flipped bit, or of a vehicle with a wrong clock."""

from typing import Final

import numpy as np
from numpy.typing import NDArray

from identify.dive import Array

WILD_S: Final = 60.0
"""A time that differs from those around it by more than this is impossible."""
AROUND: Final = 9


def tame(time_s: Array) -> NDArray[np.bool_]:
    """Which times (n,), in recording order, agree with those around them; a step of all later times is kept."""
    if len(time_s) < 2 or not np.abs(np.diff(time_s)).max() > WILD_S:
        return np.ones(len(time_s), np.bool_)
    padded = np.pad(time_s, AROUND // 2, mode="symmetric")
    usual = np.median(np.lib.stride_tricks.sliding_window_view(padded, AROUND), axis=1)
    return np.asarray(np.abs(time_s - usual) <= WILD_S)
