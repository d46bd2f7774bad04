"""Straight lines through values over dates, weighted by their standard errors; and all masses, or all dampings, as a
series.

Dives differ by more than their own intervals say (ballast, currents, manoeuvres). The values are therefore taken to
scatter about the line by a common variance in addition to their own, such that the weighted sum of squared residuals
equals its expectation (Paule and Mandel 1982, there for a mean). The slope is tested by Student's t with n - 2 degrees
of freedom (Knapp and Hartung 2003).

If the real thrust is k times the curve's, every mass and every damping comes out 1/k times its true value: their
logarithms shift together, and that of damping over mass stays.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np
from scipy.optimize import brentq
from scipy.special import stdtr, stdtrit

from bridge.arrays import Array
from identify.batch.rows import Row

FEWEST = 3
LEVEL = 0.05
ONE_MOMENT_S = 60.0
"""Dives that all began within this time count as copies of one dive: nothing ages that fast."""


@dataclass(frozen=True)
class Trend:
    """The line `mean + slope_per_s * (t - mid_s)`, and its `change` from `first_s` to `last_s`, which are Unix times.

    `scatter` is the standard deviation between dives in addition to their own standard errors. `p` is the probability
    of a slope at least as large if there is no trend.
    """

    count: int
    first_s: float
    last_s: float
    mid_s: float
    mean: float
    slope_per_s: float
    scatter: float
    change: float
    low95: float
    high95: float
    p: float

    def at(self, unix_s: float) -> float:
        return self.mean + self.slope_per_s * (unix_s - self.mid_s)

    def percent(self, difference: float) -> float:
        """A difference in per cent of the line's first value, or of its mean if the first value is not above zero."""
        begin = self.at(self.first_s)
        return 100 * difference / (begin if begin > 0 else abs(self.mean) or 1.0)

    @property
    def is_real(self) -> bool:
        """Whether the slope is significant on its own, without correction for the number of trends."""
        return self.p < LEVEL


def fit_trend(unix_s: Array, value: Array, std: Array) -> Trend | None:
    """Fit the trend of values (n,) with standard errors (n,) > 0 at Unix times (n,).

    None for fewer than FEWEST values, or if all dives began within ONE_MOMENT_S.
    """
    span_s = float(np.ptp(unix_s)) if len(unix_s) else 0.0
    if len(unix_s) < FEWEST or span_s <= ONE_MOMENT_S:
        return None
    x = (unix_s - unix_s.min()) / span_s
    between = _variance_between(x, value, std)
    mean, slope, middle, slope_variance, _ = _line(x, value, std**2 + between)
    slope_std = float(np.sqrt(slope_variance))
    freedom = len(x) - 2
    reach = float(stdtrit(freedom, 1 - LEVEL / 2)) * slope_std
    return Trend(
        len(x),
        float(unix_s.min()),
        float(unix_s.max()),
        float(unix_s.min()) + middle * span_s,
        mean,
        slope / span_s,
        float(np.sqrt(between)),
        slope,
        slope - reach,
        slope + reach,
        float(2 * stdtr(freedom, -abs(slope) / slope_std)),
    )


def holm(chances: Mapping[str, float]) -> dict[str, float]:
    """p values raised such that the probability of any false alarm among them stays below the level (Holm 1979)."""
    adjusted: dict[str, float] = {}
    highest = 0.0
    for rank, name in enumerate(sorted(chances, key=lambda name: chances[name])):
        highest = max(highest, min(1.0, (len(chances) - rank) * chances[name]))
        adjusted[name] = highest
    return adjusted


def _line(x: Array, y: Array, variance: Array) -> tuple[float, float, float, float, float]:
    """Mean, slope, weighted mean of x, variance of the slope, and weighted sum of squared residuals."""
    weight = 1 / variance
    middle = float(np.average(x, weights=weight))
    mean = float(np.average(y, weights=weight))
    spread = float(weight @ (x - middle) ** 2)
    slope = float(weight @ ((x - middle) * (y - mean))) / spread
    residual = y - mean - slope * (x - middle)
    return mean, slope, middle, 1 / spread, float(weight @ residual**2)


def _variance_between(x: Array, y: Array, std: Array) -> float:
    """Variance, in addition to `std`², at which the weighted squared residuals sum to n - 2; 0 if they are already
    smaller.
    """
    expected = len(x) - 2

    def excess(between: float) -> float:
        return _line(x, y, std**2 + between)[4] - expected

    if excess(0.0) <= 0:
        return 0.0
    high = float(np.var(y) + np.max(std) ** 2)
    while excess(high) > 0:
        high *= 2
    return float(brentq(excess, 0.0, high))


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
