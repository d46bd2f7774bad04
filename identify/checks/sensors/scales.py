"""Scale between two sensors of the same motion and its uncertainty, from their changes over windows."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bridge.arrays import Array
from identify.dive import Signal
from identify.statistics import left_of

LEAST_READ = 0.8
"""Share of the usual number of readings that a window must have."""

EDGE_S = 0.5
"""The value at a window's edge is the mean over this long before and after it."""

FEWEST_WINDOWS = 10
HEAVIEST = 0.999
"""Largest share of the motion that a window counts for; all of it in one would leave nothing to judge it by."""

DOUBTFUL_SCORE = 5.0


@dataclass(frozen=True)
class Scale:
    """Scale between two sensors: the motion that the first saw over the motion that the second reported.

    The true scale lies between `least` and `most`, however the noise is split between them (Frisch 1934): the ends
    assign all noise to the first sensor, or all to the second. std: standard error of `least`.
    """

    least: float
    most: float
    std: float

    def contradicts(self, largest_off: float) -> bool:
        """Whether the two sensors can't share a scale: the difference exceeds noise, and the error of healthy
        sensors."""
        least, most = self.least - 1.0, self.most - 1.0
        beyond_noise = abs(least) > DOUBTFUL_SCORE * self.std
        return least * most > 0 and min(abs(least), abs(most)) > largest_off and beyond_noise

    @property
    def is_known(self) -> bool:
        """Whether the scale differs from zero beyond noise."""
        return abs(self.least) > DOUBTFUL_SCORE * self.std

    @property
    def times(self) -> str:
        """The range in words, `1.92 to 2.13`; a single number if both ends round to it."""
        ends = [
            f"{end:.2g}" if abs(end) < 0.1 else f"{round(end, 2):g}"
            for end in sorted((self.least, self.most))
        ]
        return " to ".join(dict.fromkeys(ends))


def whole(signal: Signal | None) -> Signal | None:
    """The finite readings of a signal; None if fewer than two."""
    finite = None if signal is None else signal.finite()
    return finite if finite is not None and len(finite) > 1 else None


def scale_of(seen: Array, said: Array, columns: Array) -> Scale | None:
    """Scale of `seen` (n,) over `said` (n,), with the columns of `columns` (n, k) projected out of both.

    None if there are too few windows, or a sensor did not move.
    """
    if len(seen) < max(FEWEST_WINDOWS, columns.shape[1] + 2):
        return None
    said, seen = left_of(columns, said), left_of(columns, seen)
    both, said_power = float(said @ seen), float(said @ said)
    if both == 0.0 or said_power == 0.0:
        return None
    least = both / said_power
    left = seen - least * said
    free = len(seen) - columns.shape[1] - 1
    alike = math.sqrt(float(left @ left) / free / said_power)
    # Where few windows hold most of the motion, their own errors count (a jackknife; MacKinnon and White 1985, HC3).
    weight = np.minimum(said**2 / said_power, HEAVIEST)
    each = float(np.linalg.norm(said * left / (1.0 - weight))) / said_power
    return Scale(least, float(seen @ seen) / both, max(alike, each))


def well_read(time_s: Array, edges_s: Array) -> NDArray[np.bool_]:
    """Whether each window has its share of the readings at these times."""
    count = np.histogram(time_s, edges_s)[0]
    return np.asarray(count >= max(LEAST_READ * float(np.median(count)), 1.0))


def within_runs(edges_s: Array, breaks_s: Array, edge_s: float = EDGE_S) -> NDArray[np.bool_]:
    """Whether each window, with the means at both of its edges, lies within a run of the dive."""
    before, after = (np.searchsorted(breaks_s, edges_s + by_s) for by_s in (-edge_s, edge_s))
    return np.asarray(before[:-1] == after[1:])


def integral(time_s: Array, rate: Array, at_s: Array) -> Array:
    """Integral of a rate (n,) up to each of the times (m,)."""
    steps = 0.5 * (rate[1:] + rate[:-1]) * np.diff(time_s)
    return np.asarray(np.interp(at_s, time_s, np.concatenate([[0.0], np.cumsum(steps)])))


def edge_means(time_s: Array, value: Array, edges_s: Array, edge_s: float = EDGE_S) -> Array:
    """Mean (m, k) of a value (n, k) within `edge_s` of each edge (m,); NaN if nothing was read there.

    Both sensors are averaged at the same times, so that motion that comes and goes within an edge cancels alike in
    both.
    """
    total = np.concatenate([np.zeros((1, value.shape[1])), np.cumsum(value, axis=0)])
    first, last = np.searchsorted(time_s, edges_s - edge_s), np.searchsorted(time_s, edges_s + edge_s)
    count = (last - first)[:, None]
    return np.where(count > 0, (total[last] - total[first]) / np.maximum(count, 1), np.nan)
