"""Sorts the readings of a channel into the network's intervals, each as a function of the states at both ends."""

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from identify.estimators.axes import Axis
from identify.estimators.innovations import INCREMENT, POSITION

Array = NDArray[np.float64]

MANY = 3
"""From this many readings of a channel in an interval on, their mean counts as the mean over the interval."""


@dataclass(frozen=True)
class Readings:
    """Readings of a channel, one per interval, as defined in `layout.Layout`: before, after (N, s), all else (N,)."""

    value: Array
    before: Array
    after: Array
    swung: Array
    bent: Array
    open: Array
    scale: Array


def readings_in(axis: Axis, channel: int, time_s: Array, width: int, own: int, place: int) -> Readings:
    """Return the readings of a channel of an axis between the nodes' times; readings in the same interval become
    their mean.

    `own` and `place` are the indices of velocity and its integral among the `width` values of a state.
    """
    count = len(time_s) - 1
    mine = (axis.channel == channel) & np.isfinite(axis.reading)
    reads = axis.channels[channel].state_read
    at, reading, scale = axis.time_s[mine], axis.reading[mine], axis.scale[mine]
    # An increment lies before its own end; other readings lie after the node that they follow.
    side: Literal["left", "right"] = "left" if reads == INCREMENT else "right"
    k = np.clip(np.searchsorted(time_s, at, side=side) - 1, 0, count - 1)
    h = time_s[k + 1] - time_s[k]
    s = np.clip((at - time_s[k]) / h, 0.0, 1.0)
    before, after = np.zeros((len(at), width)), np.zeros((len(at), width))
    if reads == POSITION:
        bow = 0.5 * s * (1 - s) * h
        before[:, place], after[:, place] = 1 - s, s
        before[:, own], after[:, own] = bow, -bow
        swung = curved = np.zeros(len(at))
    elif reads == INCREMENT:
        # Increments are summed below to the interval's whole increment; each reading is a share of it.
        before[:, own] = after[:, own] = 0.5 * h
        swung, curved = 0.5 * h, h**2 / 12
    else:
        before[:, own], after[:, own] = 1 - s, s
        swung, curved = 1 - np.abs(2 * s - 1), 0.5 * s * (1 - s) * h
    number = np.bincount(k, minlength=count).astype(np.float64)
    total, step_s = np.maximum(number, 1.0), np.diff(time_s)

    def mean(values: Array) -> Array:
        return np.asarray(np.bincount(k, values, minlength=count) / total)

    if reads == INCREMENT:
        value = np.bincount(k, reading, minlength=count).astype(np.float64)
        spread = np.sqrt(np.bincount(k, scale**2, minlength=count))
        covered = np.bincount(k, scale, minlength=count)
        whole = np.abs(covered - step_s) < 0.02 * step_s
        value = np.where((number > 0) & whole, value, np.nan)
        left_open = step_s**5 / 720
    else:
        # Variance of integrated Brownian motion that is fixed at both ends: at a point, or of its mean.
        alone = step_s**3 * mean((s * (1 - s)) ** 3 / 3)
        left_open = np.where(number >= MANY, step_s**3 / 720, alone / total) * (reads != POSITION)
        value = np.where(number > 0, mean(reading), np.nan)
        spread = np.sqrt(mean(scale**2) / total)
    return Readings(
        value,
        np.column_stack([mean(before[:, i]) for i in range(width)]),
        np.column_stack([mean(after[:, i]) for i in range(width)]),
        mean(swung),
        mean(curved),
        left_open,
        np.where(number > 0, spread, 1.0),
    )
