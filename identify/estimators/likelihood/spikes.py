"""Spikes of a sensor among the readings that are far off what a filter expects, and motion that its model lacks.

After a spike the filter that leaves it out foretells better than the filter that takes it. In a motion that the model
lacks it falls further behind with every reading that it leaves out, and would lose the motion whole.
"""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from bridge.arrays import Array

GATE_SIGMA = 6.0
"""A reading is wild if it is off the filter's expectation by more than this many standard deviations."""

LARGEST_SHARE = 0.02
"""Largest share of an axis's readings that may be a sensor's spikes; if there are more, the model is to blame."""

RECOVERED, BURST = 5, 3
"""Number of normal readings after which a wild reading starts a new group; longest run of wild readings that can be a
single spike."""

Filtered = tuple[Array, Array]
"""Innovations and their variances, (n,) each, NaN where there is no reading."""


def spikes(
    filtered: Callable[[float], Filtered], kind: NDArray[np.int64], run: NDArray[np.intp]
) -> NDArray[np.bool_]:
    """Which readings (n,) are spikes.

    filtered: by a gate in standard deviations, beyond which innovations are clipped and update nothing. kind (n,): the
    sensor of each reading; run (n,): the run of a recording that it is of.
    """
    without = error, variance = filtered(GATE_SIGMA)
    wild = np.abs(error) >= GATE_SIGMA * np.sqrt(variance) * (1 - 1e-12)
    if not wild.any():
        return wild
    return _foretold_better(wild, _begins(wild, np.isfinite(error), kind, run), without, filtered(np.inf))


def _begins(
    wild: NDArray[np.bool_], read: NDArray[np.bool_], kind: NDArray[np.int64], run: NDArray[np.intp]
) -> NDArray[np.bool_]:
    """Which wild readings (n,) stand alone or begin a group: those in another run than the wild one before, or after
    RECOVERED readings of its sensor that were as expected."""
    at, out = np.flatnonzero(wild), np.zeros(len(wild), np.bool_)
    out[at[0]] = True
    for before, now in zip(at[:-1].tolist(), at[1:].tolist(), strict=True):
        between = slice(before + 1, now)
        expected = np.count_nonzero(read[between] & (kind[between] == kind[before]))
        out[now] = run[now] != run[before] or expected >= RECOVERED
    return out


def _foretold_better(
    wild: NDArray[np.bool_], begins: NDArray[np.bool_], without: Filtered, with_all: Filtered
) -> NDArray[np.bool_]:
    """Which wild readings (n,) are of a group, some of which `begins` (n,), after whose first BURST readings the filter
    `without` wild readings foretells no worse than the filter that takes all. A group that nothing follows is a spike.

    Neither filter pays more for a reading than for one at the gate, so that no single one decides.
    """
    group, count = np.cumsum(begins), np.cumsum(wild)
    before = np.maximum.accumulate(np.where(begins, count - 1, 0))
    first = wild & (count - before <= BURST)
    nats = [
        -0.5 * np.nan_to_num(np.minimum(error**2 / variance, GATE_SIGMA**2) + np.log(variance))
        for error, variance in (without, with_all)
    ]
    better = np.bincount(group, np.where(first, 0.0, nats[0] - nats[1])) >= 0
    return np.asarray(wild & better[group])
