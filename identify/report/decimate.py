"""Fewer points for the eye: what a plot of so many columns can show, with every extreme kept."""

import numpy as np

from identify.dive import Array, Signal

BINS = 600


def envelope(x: Array, y: Array, bins: int = BINS) -> tuple[Array, Array]:
    """First, lowest, highest and last point of each of `bins` stretches of `x` (rising), in their order.

    A gap (NaN in `y`) wider than a stretch stays as one NaN; a narrower one could not be seen. Short signals
    come back whole.
    """
    if len(x) <= 4 * bins:
        return x, y
    known = np.flatnonzero(np.isfinite(y))
    edges = np.linspace(x[0], x[-1], bins + 1)
    cuts = np.searchsorted(x[known], edges[1:-1])
    keep: set[int] = set()
    for part in np.split(known, cuts):
        if len(part):
            values = y[part]
            keep.update((int(part[0]), int(part[values.argmin()]), int(part[values.argmax()]), int(part[-1])))
    before, after = known[:-1], known[1:]
    wide = (after - before > 1) & (x[after] - x[before] > edges[1] - edges[0])
    keep.update((before[wide] + 1).tolist())
    index = np.array(sorted(keep), dtype=np.int64)
    return x[index], y[index]


def broken_at_gaps(signal: Signal, column: int, longer_than_s: float) -> tuple[Array, Array]:
    """Times and one column, with a NaN put into each silence of more than `longer_than_s`."""
    time_s, value = signal.time_s, signal.value[:, column]
    after = np.flatnonzero(np.diff(time_s) > longer_than_s) + 1
    return np.insert(time_s, after, time_s[after - 1]), np.insert(value, after, np.nan)
