"""Fade-in of everything that comes with the feed-forward, so that raising FF_MODE makes no thruster jump."""

from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from bridge.vehicle.feedforward import LONGEST_TICK_S, SLOPE_PER_S

Blended = TypeVar("Blended", float, NDArray[np.float64])


class Onset:
    """A share that rises from 0 to 1 as fast as `Slope` lets the feed-forward grow, and drops to 0 at once when it is
    off.

    It fades in the changes that accompany the feed-forward's wrench: thrusts that compensate losses or jump over the
    dead zone, and a stiffer PID.
    """

    def __init__(self) -> None:
        self.share = 0.0

    def step(self, is_applied: bool, dt_s: float) -> None:
        """Advance by a tick that comes `dt_s` after the previous one; a late tick counts for no more than `Slope`
        allows."""
        grown = self.share + SLOPE_PER_S * min(max(dt_s, 0.0), LONGEST_TICK_S)
        self.share = min(grown, 1.0) if is_applied else 0.0

    def between(self, without: Blended, with_it: Blended) -> Blended:
        """Blend the two values by the current share; exact to the last bit at 0 and 1."""
        return (1.0 - self.share) * without + self.share * with_it
