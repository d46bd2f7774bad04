"""Loss of all thrust with the battery's measured voltage."""

import math
from dataclasses import dataclass

from bridge.vehicle.effect_coefficients import LEAST_GAIN, MOST_GAIN

SLOW_S = 20.0
"""Time constant for averaging the measured voltage: faster changes come from the load."""
LOWEST_SHARE, HIGHEST_SHARE = 0.5, 1.5
"""Shares of the reference voltage: a reading outside of them comes from a broken sensor."""


@dataclass(frozen=True)
class VoltageLaw:
    """T = T_nominal (1 - share (1 - (V / reference_v)^2))."""

    reference_v: float
    share: float

    def factor(self, voltage_v: float) -> float:
        """Thrust relative to that at the reference voltage, limited to the range of a thruster's gain."""
        fallen = 1.0 - self.share * (1.0 - (voltage_v / self.reference_v) ** 2)
        return min(max(fallen, LEAST_GAIN), MOST_GAIN)


class Supply:
    """Share of thrust left as the battery empties, from its measured voltage averaged over `SLOW_S`.

    A missing or impossible reading counts as the reference voltage, averaged in slowly, so that a sensor that comes
    and goes does not make the thrust jump.
    """

    def __init__(self) -> None:
        self._slow_v = math.nan

    def step(self, law: VoltageLaw, voltage_v: float, dt_s: float) -> float:
        """Return the factor of this tick; `voltage_v` is NaN if unknown."""
        share = voltage_v / law.reference_v
        now_v = voltage_v if LOWEST_SHARE <= share <= HIGHEST_SHARE else law.reference_v
        if math.isnan(self._slow_v):
            self._slow_v = now_v
        elif dt_s > 0:
            self._slow_v += (1.0 - math.exp(-dt_s / SLOW_S)) * (now_v - self._slow_v)
        return law.factor(self._slow_v)
