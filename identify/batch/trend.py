"""Fits a straight line to values over dates, weighted by their standard errors, and tests its slope.

Dives differ by more than their own intervals say (ballast, currents, manoeuvres). The values are therefore taken to
scatter about the line by a common variance in addition to their own, chosen such that the weighted sum of squared
residuals equals its expectation (Paule and Mandel 1982, there for a mean, here for a line). The slope is tested by
Student's t with n - 2 degrees of freedom (Knapp and Hartung 2003).
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from scipy.special import stdtr, stdtrit

from identify.dive import Array

FEWEST = 3
LEVEL = 0.05
ONE_MOMENT_S = 60.0
"""Dives that all began within this time count as copies of one dive: nothing ages that fast."""

_HALVINGS = 200


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
    change_std: float
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
        slope_std,
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
    low, high = 0.0, float(np.var(y) + np.max(std) ** 2)
    while excess(high) > 0:
        high *= 2
    for _ in range(_HALVINGS):
        middle = (low + high) / 2
        if not low < middle < high:
            break
        low, high = (middle, high) if excess(middle) > 0 else (low, middle)
    return high
