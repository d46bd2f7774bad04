"""Scale between two sensors of the same motion and its uncertainty, from their changes over windows."""

import math
from dataclasses import dataclass

import numpy as np

from bridge.arrays import Array
from identify.statistics import left_of

FEWEST_WINDOWS = 10
HEAVIEST = 0.999
"""Most that the jackknife takes for a window's share of the motion: at a share of 1 it would divide by zero."""

DOUBTFUL_SCORE = 5.0
"""Standard errors from which a difference is no noise."""


@dataclass(frozen=True)
class Scale:
    """Scale between two sensors: the motion that the first saw over the motion that the second reported.

    The true scale lies between `least` and `most`, however the noise is split between them (Frisch 1934): the ends
    assign all noise to the first sensor, or all to the second. std: standard error of `least`.
    """

    least: float
    most: float
    std: float

    def contradicts(self, largest_off: float) -> bool:
        """Whether the two sensors can't share a scale: the difference exceeds noise, and the error of healthy
        sensors."""
        least, most = self.least - 1.0, self.most - 1.0
        beyond_noise = abs(least) > DOUBTFUL_SCORE * self.std
        return least * most > 0 and min(abs(least), abs(most)) > largest_off and beyond_noise

    @property
    def is_known(self) -> bool:
        """Whether the scale differs from zero beyond noise."""
        return abs(self.least) > DOUBTFUL_SCORE * self.std

    @property
    def times(self) -> str:
        """The range in words, `1.92 to 2.13`; a single number if both ends round to it."""
        ends = [
            f"{end:.2g}" if abs(end) < 0.1 else f"{round(end, 2):g}"
            for end in sorted((self.least, self.most))
        ]
        return " to ".join(dict.fromkeys(ends))


def scale_of(seen: Array, said: Array, columns: Array) -> Scale | None:
    """Scale of one sensor's changes over windows, `seen` (n,), relative to another's, `said` (n,).

    The columns (n, k) are first projected out of both: known motions that the two sensors don't share.

    None if there are too few windows, or a sensor did not move.
    """
    if len(seen) < max(FEWEST_WINDOWS, columns.shape[1] + 2):
        return None
    said, seen = left_of(columns, said), left_of(columns, seen)
    both, said_power = float(said @ seen), float(said @ said)
    if both == 0.0 or said_power == 0.0:
        return None
    least = both / said_power
    left = seen - least * said
    free = len(seen) - columns.shape[1] - 1
    alike = math.sqrt(float(left @ left) / free / said_power)
    # Where few windows hold most of the motion, their own errors count (a jackknife; MacKinnon and White 1985, HC3).
    weight = np.minimum(said**2 / said_power, HEAVIEST)
    each = float(np.linalg.norm(said * left / (1.0 - weight))) / said_power
    return Scale(least, float(seen @ seen) / both, max(alike, each))
