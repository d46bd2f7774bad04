"""By how much all thrust falls with the battery's measured voltage."""

import math
from dataclasses import dataclass

from bridge.vehicle.effect_coefficients import LEAST_GAIN, MOST_GAIN

SLOW_S = 20.0
"""A measured voltage is meant over so long: what is quicker is the load's."""
LOWEST_SHARE, HIGHEST_SHARE = 0.5, 1.5
"""Of the reference voltage: what is measured outside of them is a broken sensor's."""


@dataclass(frozen=True)
class VoltageLaw:
    """T = T_nominal (1 - share (1 - (V / reference_v)^2))."""

    reference_v: float
    share: float

    def factor(self, voltage_v: float) -> float:
        """Thrust over that at the reference voltage; no less and no more than a thruster's gain may be."""
        fallen = 1.0 - self.share * (1.0 - (voltage_v / self.reference_v) ** 2)
        return min(max(fallen, LEAST_GAIN), MOST_GAIN)


class Supply:
    """What is left of all thrust as the battery empties, by its measured voltage meant over `SLOW_S`.

    Nothing measured, or what no battery can have, counts as the reference voltage: slowly, so that a reading that comes
    and goes is no reason for a jump.
    """

    def __init__(self) -> None:
        self._slow_v = math.nan

    def step(self, law: VoltageLaw, voltage_v: float, dt_s: float) -> float:
        """The factor of this tick; `voltage_v` is NaN where none is known."""
        share = voltage_v / law.reference_v
        now_v = voltage_v if LOWEST_SHARE <= share <= HIGHEST_SHARE else law.reference_v
        if math.isnan(self._slow_v):
            self._slow_v = now_v
        elif dt_s > 0:
            self._slow_v += (1.0 - math.exp(-dt_s / SLOW_S)) * (now_v - self._slow_v)
        return law.factor(self._slow_v)
