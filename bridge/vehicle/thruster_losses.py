"""Losses between the thrust asked of a thruster by its curve and the thrust that it gives, in both directions.

Asked for a (N), a thruster gives T = s g a'. Here a' is a less the loss in its dead zone, g is its gain (times the
gain astern), and s = (1 - R I / V)^2 comes from the sagging supply, with I proportional to |a|^1.5.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bridge.vehicle.effect_coefficients import LEAST_GAIN

Array = NDArray[np.float64]

NOMINAL_V = 16.0
AHEAD_A_N15, ASTERN_A_N15 = 0.062, 0.095
"""Current over |thrust|^1.5 of a T200 at `NOMINAL_V`, from Blue Robotics' bollard pull of 2019: within 5 % from 18 N
to 51 N ahead, and 28 N to 40 N astern."""
LEAST_LEFT = 0.5
"""Least share of thrust assumed to remain under a sagging supply: a resistance that leaves less is not plausible."""
ITERATIONS = 12


@dataclass(frozen=True)
class Losses:
    """gain (n,): thrust of each thruster relative to its curve; astern: a common factor for all that push astern.

    start_n: thrust asked before any thrust begins. least_n: a smaller demand gives nothing, a larger one all of it.
    resistance_ohm: of supply and cables.
    """

    gain: Array
    astern: float = 1.0
    start_n: float = 0.0
    least_n: float = 0.0
    resistance_ohm: float = 0.0

    def given(self, asked_n: Array, supply: float = 1.0) -> Array:
        """Thrusts (n,) in N that result from the thrusts asked for; `supply` is the factor of `Supply`."""
        return np.asarray(self.turned(asked_n) * self._gains(asked_n, supply))

    def turned(self, asked_n: Array) -> Array:
        """Thrusts (n,) that the shaft speeds indicate: a weak propeller turns as fast as a good one."""
        size = np.abs(asked_n)
        passed = np.where(size < self.least_n, 0.0, np.maximum(size - self.start_n, 0.0))
        return np.asarray(np.sign(asked_n) * passed * self._left(asked_n))

    def made_up(
        self, thrust_n: Array, supply: float, gentle_n: Array, limits_n: tuple[float, float]
    ) -> tuple[Array, float]:
        """Return the thrusts (n,) to ask for, within the limits, so that `thrust_n` (n,) results, and the share of it
        that is achieved: if any thruster would exceed its limit, all are scaled down together.

        Below `gentle_n` (n,) the dead zone's width is added in proportion to the wanted thrust: jumping over it near
        zero, noise would throw the propellers to and fro. An unavailable thrust is rounded to zero or to the least
        available thrust, whichever is nearer.
        """
        # Several losses together must not raise the command more than the worst single loss.
        gains = np.maximum(self._gains(thrust_n, supply), LEAST_GAIN)
        limit_n = np.where(thrust_n < 0, -limits_n[0], limits_n[1])
        size, left, share = np.abs(thrust_n), 1.0, 1.0
        for _ in range(ITERATIONS if self.resistance_ohm else 1):
            able = np.maximum(limit_n - self.start_n, 0.0) * gains * left
            over = size > able
            share = float((able[over] / size[over]).min()) if over.any() else 1.0
            asked = np.sign(thrust_n) * self._through_dead_zone(share * size / (gains * left), gentle_n)
            left = self._left(asked)
        return np.clip(asked, *limits_n), share

    def _gains(self, sign: Array, supply: float) -> Array:
        return np.asarray(self.gain * np.where(sign < 0, self.astern, 1.0) * supply)

    def _left(self, asked_n: Array) -> float:
        if not self.resistance_ohm:
            return 1.0
        current = float((np.where(asked_n > 0, AHEAD_A_N15, ASTERN_A_N15) * np.abs(asked_n) ** 1.5).sum())
        return max((1.0 - min(self.resistance_ohm * current / NOMINAL_V, 1.0)) ** 2, LEAST_LEFT)

    def _through_dead_zone(self, size_n: Array, gentle_n: Array) -> Array:
        """Return the magnitudes to ask for, given the magnitudes wanted beyond the dead zone."""
        share = np.where(size_n < gentle_n, size_n / np.where(gentle_n > 0, gentle_n, 1.0), 1.0)
        asked = np.where(size_n > 0, size_n + self.start_n * share, 0.0)
        between = (asked < self.least_n) & (asked >= 0.5 * self.least_n)
        return np.where(between, self.least_n, asked)
