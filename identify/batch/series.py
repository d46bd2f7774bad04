"""Several coefficients as one series: how all masses, or all dampings, of a vehicle go from dive to dive.

An identification knows forces only through the thruster curve. Where the real thrust is k times what the curve says,
every mass and every damping comes out 1/k times its own, so their logarithms shift together, while the logarithm of
damping over mass stays.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np

from identify.batch.rows import Row
from identify.dive import Array

CANCELLED = 1e-4
"""Errors that cancel leave at least this share of a variance: a correlation is not known better."""


@dataclass(frozen=True)
class Series:
    """Logarithms (n,) with standard errors (n,) at Unix times (n,).

    `rows` says of which row each is, `weights` how much each coefficient of that row has in it.
    """

    rows: tuple[int, ...]
    unix_s: Array
    value: Array
    std: Array
    weights: tuple[Mapping[str, float], ...] = ()


def common_series(rows: Sequence[Row], names: Sequence[str]) -> Series:
    """The weighted mean logarithm of the coefficients `names` in each dated row, less each one's own level.

    A level is where a coefficient stands beside a line in time that all share, by weighted least squares, so that a
    dive which shows other coefficients than the next does not look like a change. Weights go by each one's own error;
    the standard error of the mean counts how the coefficients of one dive err together.
    """
    of, which, y, sigma = [], [], [], []
    for i, row in enumerate(rows):
        for j, name in enumerate(names):
            found = row.values.get(name)
            if found is not None and row.unix_s is not None and found.value > 0 and found.std > 0:
                of.append(i)
                which.append(j)
                y.append(np.log(found.value))
                sigma.append(found.std / found.value)
    if not of:
        nothing = np.zeros(0)
        return Series((), nothing, nothing, nothing)
    row_of, weight, logs = np.array(of), 1 / np.array(sigma) ** 2, np.array(y)
    times = np.array([row.unix_s if row.unix_s is not None else np.nan for row in rows])
    off = logs - _levels(times[row_of], np.array(which), logs, weight, len(names))
    present = tuple(sorted(set(of)))
    total = np.array([weight[row_of == i].sum() for i in present])
    mean = np.array([(weight * off)[row_of == i].sum() for i in present]) / total
    shares = tuple(
        {names[which[k]]: float(weight[k] / whole) for k in np.flatnonzero(row_of == i)}
        for i, whole in zip(present, total, strict=True)
    )
    std = np.array([_std(rows[i], of_row) for i, of_row in zip(present, shares, strict=True)])
    return Series(present, times[list(present)], mean, std, shares)


def ratio(over: Series, under: Series, rows: Sequence[Row]) -> Series:
    """`over` less `under`, two series of `rows` without a coefficient in common, in the rows that both have."""
    both = tuple(i for i in over.rows if i in under.rows)
    a = [over.rows.index(i) for i in both]
    b = [under.rows.index(i) for i in both]
    weights = tuple(
        {**over.weights[i], **{name: -share for name, share in under.weights[j].items()}}
        for i, j in zip(a, b, strict=True)
    )
    std = np.array([_std(rows[i], of_row) for i, of_row in zip(both, weights, strict=True)])
    return Series(both, over.unix_s[a], over.value[a] - under.value[b], std, weights)


def _std(row: Row, weights: Mapping[str, float]) -> float:
    """Standard error of the weighted sum of a row's logarithms, which err together."""
    own = {name: share * row.values[name].std / row.values[name].value for name, share in weights.items()}
    alone = sum(error**2 for error in own.values())
    together = sum(
        2 * row.correlation.get(frozenset(pair), 0.0) * own[pair[0]] * own[pair[1]]
        for pair in combinations(own, 2)
    )
    return math.sqrt(max(alone + together, CANCELLED * alone))


def _levels(unix_s: Array, which: Array, logs: Array, weight: Array, count: int) -> Array:
    """The level of the coefficient of each entry, beside one slope that all share."""
    span_s = float(np.ptp(unix_s)) or 1.0
    design = np.column_stack([which[:, None] == np.arange(count), (unix_s - unix_s.mean()) / span_s])
    root = np.sqrt(weight)
    solution = np.linalg.lstsq(design * root[:, None], logs * root, rcond=None)[0]
    levels: Array = solution[:count][which.astype(int)]
    return levels
