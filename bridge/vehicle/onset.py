"""How far what comes with the feed-forward is in force, so that raising it moves no thruster in one jump."""

from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from bridge.vehicle.feedforward import LONGEST_TICK_S, SLOPE_PER_S

Blended = TypeVar("Blended", float, NDArray[np.float64])


class Onset:
    """From nothing to all as fast as `Slope` lets the feed-forward itself grow; nothing at once where none is applied.

    It is for what changes beside the feed-forward's own wrench: thrusts that make up for losses or pass the dead zone,
    and a stiffer PID.
    """

    def __init__(self) -> None:
        self.share = 0.0

    def step(self, is_applied: bool, dt_s: float) -> None:
        """Go on by a tick that comes `dt_s` after the last one; a late one is worth no more than it is to `Slope`."""
        grown = self.share + SLOPE_PER_S * min(max(dt_s, 0.0), LONGEST_TICK_S)
        self.share = min(grown, 1.0) if is_applied else 0.0

    def between(self, without: Blended, with_it: Blended) -> Blended:
        """Which of the two is in force now, or what lies between; to the last bit either at the ends."""
        return (1.0 - self.share) * without + self.share * with_it
