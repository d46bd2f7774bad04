"""Combines several coefficients of a vehicle into a series: how all masses, or all dampings, change from dive to dive.

An identification knows forces only through the thruster curve. If the real thrust is k times the curve's, every mass
and every damping comes out 1/k times its true value. Their logarithms then shift together, while the logarithm of
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
"""Smallest share of the variance that is left when errors cancel: correlations are not known better than that."""


@dataclass(frozen=True)
class Series:
    """Logarithms (n,) with standard errors (n,) at Unix times (n,).

    `rows` is the index of each entry's row, `weights` the weight of each coefficient in the entry.
    """

    rows: tuple[int, ...]
    unix_s: Array
    value: Array
    std: Array
    weights: tuple[Mapping[str, float], ...] = ()


def common_series(rows: Sequence[Row], names: Sequence[str]) -> Series:
    """Weighted mean logarithm of the coefficients `names` in each dated row, after removal of each coefficient's level.

    The levels are fitted together with a common slope in time, by weighted least squares, so that a dive that shows
    other coefficients than the next does not look like a change. Each value is weighted by its own standard error;
    the standard error of the mean includes the correlations of the coefficients within a dive.
    """
    row_indices, which, y, sigma = [], [], [], []
    for i, row in enumerate(rows):
        for j, name in enumerate(names):
            parameter = row.values.get(name)
            if parameter is not None and row.unix_s is not None and parameter.value > 0 and parameter.std > 0:
                row_indices.append(i)
                which.append(j)
                y.append(np.log(parameter.value))
                sigma.append(parameter.std / parameter.value)
    if not row_indices:
        nothing = np.zeros(0)
        return Series((), nothing, nothing, nothing)
    row_of, weight, logs = np.array(row_indices), 1 / np.array(sigma) ** 2, np.array(y)
    times = np.array([row.unix_s if row.unix_s is not None else np.nan for row in rows])
    off = logs - _levels(times[row_of], np.array(which), logs, weight, len(names))
    present = tuple(sorted(set(row_indices)))
    total = np.array([weight[row_of == i].sum() for i in present])
    mean = np.array([(weight * off)[row_of == i].sum() for i in present]) / total
    shares = tuple(
        {names[which[k]]: float(weight[k] / whole) for k in np.flatnonzero(row_of == i)}
        for i, whole in zip(present, total, strict=True)
    )
    std = np.array([_std(rows[i], of_row) for i, of_row in zip(present, shares, strict=True)])
    return Series(present, times[list(present)], mean, std, shares)


def ratio(over: Series, under: Series, rows: Sequence[Row]) -> Series:
    """`over` minus `under` in the rows that both have. The two series come from `rows` and share no coefficient."""
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
    """Standard error of the weighted sum of a row's logarithms, whose errors are correlated."""
    errors = {name: share * row.values[name].std / row.values[name].value for name, share in weights.items()}
    alone = sum(error**2 for error in errors.values())
    together = sum(
        2 * row.correlation.get(frozenset(pair), 0.0) * errors[pair[0]] * errors[pair[1]]
        for pair in combinations(errors, 2)
    )
    return math.sqrt(max(alone + together, CANCELLED * alone))


def _levels(unix_s: Array, which: Array, logs: Array, weight: Array, count: int) -> Array:
    """Level of the coefficient of each entry, fitted together with a common slope in time."""
    span_s = float(np.ptp(unix_s)) or 1.0
    design = np.column_stack([which[:, None] == np.arange(count), (unix_s - unix_s.mean()) / span_s])
    root = np.sqrt(weight)
    solution = np.linalg.lstsq(design * root[:, None], logs * root, rcond=None)[0]
    levels: Array = solution[:count][which.astype(int)]
    return levels
