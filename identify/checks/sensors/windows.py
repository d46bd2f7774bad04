"""Windows of a dive over which two sensors are compared: means at their edges, integrals, which count."""

import numpy as np
from numpy.typing import NDArray

from bridge.arrays import Array
from identify.dive import Signal

LEAST_READ = 0.8
"""Share of the usual number of readings that a window must have."""

EDGE_S = 0.5
"""The value at a window's edge is the mean over this long before and after it."""

NEAR = 10
"""Windows on either side whose mean is that of a slow drift."""


def finite_readings(signal: Signal | None) -> Signal | None:
    """The finite readings of a signal; None if fewer than two."""
    finite = None if signal is None else signal.finite()
    return finite if finite is not None and len(finite) > 1 else None


def well_read(time_s: Array, edges_s: Array) -> NDArray[np.bool_]:
    """Whether each window between the edges (m,) has at least LEAST_READ of the median number of readings, (m - 1,)."""
    count = np.histogram(time_s, edges_s)[0]
    return np.asarray(count >= max(LEAST_READ * float(np.median(count)), 1.0))


def within_runs(edges_s: Array, breaks_s: Array, edge_s: float = EDGE_S) -> NDArray[np.bool_]:
    """Whether each window between the edges (m,) lies within one run of the dive, (m - 1,).

    The means over `edge_s` at both of its edges count as part of it.
    """
    before, after = (np.searchsorted(breaks_s, edges_s + by_s) for by_s in (-edge_s, edge_s))
    return np.asarray(before[:-1] == after[1:])


def integral(time_s: Array, rate: Array, at_s: Array) -> Array:
    """Integral (m,) of a rate (n,), by the trapezoid rule, from the first reading up to each of the times (m,)."""
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


def slow(tables: Array) -> Array:
    """Running mean over a window and NEAR windows on either side, for (k, n, columns). Near the ends it uses fewer,
    as many on either side, so that subtracting the mean removes a trend entirely."""
    count = tables.shape[1]
    total = np.concatenate([np.zeros_like(tables[:, :1]), np.cumsum(tables, axis=1)], axis=1)
    at = np.arange(count)
    near = np.minimum(NEAR, np.minimum(at, count - 1 - at))
    return np.asarray((total[:, at + near + 1] - total[:, at - near]) / (2 * near + 1)[:, None])
