"""Compares two clocks: the offset and drift between them, and the uncertainty of both."""

from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from bridge.arrays import Array

CRYSTAL: Final = 1e-4
"""Standard deviation of the drift between two crystals: the prior before any comparison."""
LEAST_S: Final = 5e-4
"""Least uncertainty stated for an offset: both sides stamp their messages in milliseconds."""
ROUNDS: Final = 30
HUBER: Final = 1.345
NORMAL: Final = 1.4826
"""Standard deviation of a normal distribution divided by its median absolute deviation."""


@dataclass(frozen=True)
class ClockLine:
    """The other clock reads `offset_s` more at time `at_s` of this clock, and gains `drift` seconds a second.

    `offset_std_s` and `drift_std` are standard errors. They are uncorrelated, as `at_s` is the middle of the data.
    """

    at_s: float
    offset_s: float
    drift: float
    offset_std_s: float
    drift_std: float

    def ahead_s(self, time_s: Array) -> Array:
        """Seconds by which the other clock is ahead at times (n,) of this clock."""
        return self.offset_s + self.drift * (time_s - self.at_s)

    def here_s(self, other_s: Array) -> Array:
        """Convert times (n,) of the other clock to times of this clock."""
        return self.at_s + (other_s - self.offset_s - self.at_s) / (1.0 + self.drift)

    def within_s(self, start_s: float, end_s: float) -> float:
        """Half-width (s) of the 95 % interval of `ahead_s`, at its widest in a span of this clock's time."""
        far_s = max(abs(start_s - self.at_s), abs(end_s - self.at_s))
        return 2.0 * float(np.hypot(self.offset_std_s, self.drift_std * far_s)) + LEAST_S

    def words(self, start_s: float, end_s: float) -> str:
        """Say `is 12.700 s behind, gains 40 ± 3 ppm, and is known to 2 ms`, for a span of this clock's time."""
        ahead = f"{abs(self.offset_s):.3f} s {'ahead' if self.offset_s >= 0 else 'behind'}"
        ppm, most = 1e6 * self.drift, max(1.0, 2e6 * self.drift_std)
        rate = f"{'gains' if ppm >= 0 else 'loses'} {abs(ppm):.0f} ± {most:.0f} ppm"
        return f"is {ahead}, {rate}, and is known to {max(1.0, 1e3 * self.within_s(start_s, end_s)):.0f} ms"


def fit_clock(time_s: Array, ahead_s: Array, std_s: Array) -> ClockLine:
    """Fit a line to offsets (n,) measured at times (n,) of this clock, each with a standard error (n,) above 0.

    Robust: the farther an offset lies from the others, the less it counts (Huber 1964). Scatter beyond the standard
    errors is taken for a further error common to all offsets. n is at least 1.
    """
    at_s = float(np.average(time_s, weights=std_s**-2))
    level_s = float(np.median(ahead_s))
    design = np.column_stack((np.ones(len(time_s)), time_s - at_s))
    prior = np.diag((0.0, CRYSTAL**-2))
    weight, more_s = np.ones(len(time_s)), 0.0
    covariance: NDArray[Any] = np.zeros((2, 2))
    line: NDArray[Any] = np.zeros(2)
    each = weight
    for _ in range(ROUNDS):
        each = weight / (std_s**2 + more_s**2)
        covariance = np.linalg.inv(design.T @ (design * each[:, None]) + prior)
        line = covariance @ (design.T @ (each * (ahead_s - level_s)))
        off_s = np.abs(ahead_s - level_s - design @ line)
        more_s = max(0.0, (NORMAL * float(np.median(off_s))) ** 2 - float(np.median(std_s)) ** 2) ** 0.5
        weight = np.minimum(1.0, HUBER * np.hypot(std_s, more_s) / np.maximum(off_s, 1e-12))
    # The errors that the scatter of the offsets shows, whatever was stated of each (White 1980), if they are larger.
    left = each * (ahead_s - level_s - design @ line)
    sandwich = covariance @ (design.T @ (design * left[:, None] ** 2)) @ covariance
    widest = max(1.0, float((np.diag(sandwich) / np.diag(covariance)).max()))
    covariance = covariance * widest
    middle_s = at_s - covariance[0, 1] / covariance[1, 1]
    offset_s = level_s + line[0] + line[1] * (middle_s - at_s)
    offset_var = covariance[0, 0] - covariance[0, 1] ** 2 / covariance[1, 1]
    errors = float(offset_var**0.5), float(covariance[1, 1] ** 0.5)
    return ClockLine(float(middle_s), float(offset_s), float(line[1]), *errors)
