"""Range of an axis: its ends are multiples of a step of 1, 2 or 5 times a power of ten, so that it rarely changes."""

import math
from dataclasses import dataclass

import numpy as np

from gcs_plugin.watch.picture import Array


@dataclass(frozen=True)
class Scale:
    """An axis from `low` to `high`, both multiples of `step`."""

    low: float
    high: float
    step: float

    @property
    def digits(self) -> int:
        """Decimals that its ticks need."""
        return max(0, -math.floor(math.log10(self.step) + 1e-9))


def nice_step(least: float) -> float:
    """The smallest of 1, 2, 5 times a power of ten that is at least `least`."""
    power = 10.0 ** math.floor(math.log10(least))
    return next(factor * power for factor in (1.0, 2.0, 5.0, 10.0) if factor * power >= least * (1 - 1e-9))


def scale_for(values: Array, least_span: float, with_zero: bool, steps: int = 4) -> Scale:
    """Scale that covers all finite `values`: at least `least_span`, in about `steps` steps."""
    known = values[np.isfinite(values)]
    low, high = (float(known.min()), float(known.max())) if known.size else (0.0, 0.0)
    step = nice_step(max(high - low, least_span) / steps)
    if with_zero:
        low, high = min(low, 0.0), max(high, 0.0)
        if high - low < least_span:
            low, high = min(low, -least_span / 2), max(high, least_span / 2)
        step = nice_step((high - low) / steps)
    elif high - low < least_span:
        middle = step * round((low + high) / 2 / step)
        low, high = min(low, middle - least_span / 2), max(high, middle + least_span / 2)
    return Scale(step * math.floor(low / step + 1e-9), step * math.ceil(high / step - 1e-9), step)
