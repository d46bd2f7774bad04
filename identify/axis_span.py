"""How far thrust and speed of an axis range in a dive."""

import math
from dataclasses import dataclass


@dataclass(frozen=True)
class Span:
    """Overview of an axis: seconds for which thrust and speed were both recorded, and the 1 to 99 % span of each.

    `thrust` in N or N m, `speed` in m/s or rad/s; NaN if not recorded.
    """

    axis: str
    seconds: float
    thrust: float = math.nan
    speed: float = math.nan
