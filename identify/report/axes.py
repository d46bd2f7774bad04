"""Axes: a range, where its ticks stand and what they say."""

import math
from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from identify.dive import Array
from identify.report.text import fixed


@dataclass(frozen=True)
class Axis:
    """A range from `low` (left or bottom) to `high`, either may be the larger, and its labelled ticks."""

    title: str
    low: float
    high: float
    ticks: tuple[tuple[float, str], ...]

    def fraction(self, value: Array) -> Array:
        """0 at `low`, 1 at `high`."""
        return (value - self.low) / (self.high - self.low)

    def percent(self, value: float) -> float:
        """Where `value` stands, 0 at `low` and 100 at `high`."""
        return 100 * (value - self.low) / (self.high - self.low)

    def reversed(self) -> "Axis":
        """The same axis the other way round, as depth is drawn."""
        return Axis(self.title, self.high, self.low, self.ticks)


def nice_step(low: float, high: float, at_least: int) -> float:
    """The largest step, 1, 2 or 5 times a power of ten, that puts `at_least` ticks into the range.

    At most 5 ticks come of 2, 7 of 3: what the room for labels has to hold.
    """
    power = 10.0 ** math.ceil(math.log10(high - low))
    while True:
        for step in (power, power / 2, power / 5):
            if len(_multiples(low, high, step)) >= at_least:
                return step
        power /= 10


def _multiples(low: float, high: float, step: float) -> range:
    return range(math.ceil(low / step - 1e-6), math.floor(high / step + 1e-6) + 1)


def ticks_between(low: float, high: float, step: float) -> tuple[tuple[float, str], ...]:
    """Multiples of `step` in [low, high], labelled with no more decimals than the step has."""
    decimals = max(0, -math.floor(math.log10(step) + 1e-9))
    return tuple((i * step, fixed(i * step, decimals)) for i in _multiples(low, high, step))


def extent(values: Iterable[Array]) -> tuple[float, float]:
    """Lowest and highest finite value; (0, 1) where there is none."""
    finite = [v[np.isfinite(v)] for v in values]
    known = [v for v in finite if len(v)]
    if not known:
        return 0.0, 1.0
    return min(float(v.min()) for v in known), max(float(v.max()) for v in known)


def close_axis(title: str, low: float, high: float, at_least: int = 3) -> Axis:
    """An axis from exactly `low` to `high`; a range of nothing is widened."""
    if not high - low > 1e-9 * max(abs(low), abs(high), 1e-6):
        reach = 0.05 * abs(low) or 1.0
        low, high = low - reach, high + reach
    return Axis(title, low, high, ticks_between(low, high, nice_step(low, high, at_least)))


def roomy_axis(title: str, values: Iterable[Array], at_least: int = 3) -> Axis:
    """An axis around `values` with a little air at both ends."""
    low, high = extent(values)
    air = 0.06 * (high - low)
    return close_axis(title, low - air, high + air, at_least)


def named_axis(names: Iterable[str]) -> Axis:
    """Names from top to bottom, the first at 0, the next at 1 and so on."""
    ticks = tuple((float(i), name) for i, name in enumerate(names))
    return Axis("", len(ticks) - 0.5, -0.5, ticks)
