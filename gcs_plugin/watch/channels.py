"""Who tells a signal, how often, since when it says nothing: one channel a signal, however many could tell it."""

import math
from collections import deque
from collections.abc import Callable
from typing import Final

from gcs_plugin.watch.hearing import Values

TIMES_KEPT: Final = 64
RATE_OVER_S: Final = 10.0
YIELDS_AFTER_S: Final = 3.0
"""A teller that is silent for so long leaves its signal to the next one, be that a worse one."""

Teller = tuple[int, int]
"""Rank, component."""


class Channel:
    """What one signal last said. `says` judges whether values say anything.

    `said_s` is when they last did, `heard_s` when anything came, `first_s` when for the first time.
    """

    __slots__ = ("_says", "_times_s", "first_s", "heard_s", "said_s", "teller", "values")

    def __init__(self, says: Callable[[Values], bool]) -> None:
        self._says = says
        self._times_s: deque[float] = deque(maxlen=TIMES_KEPT)
        self.teller: Teller = (0, 0)
        self.values: Values = ()
        self.first_s = math.inf
        self.heard_s = self.said_s = -math.inf

    def take(self, teller: Teller, values: Values, time_s: float) -> bool:
        """Whether these values are taken: a better teller's, or those of the one that tells by now."""
        if teller != self.teller:
            if teller[0] >= self.teller[0] and time_s - self.heard_s < YIELDS_AFTER_S:
                return False
            self.teller = teller
            self._times_s.clear()
        if not self._times_s and self.first_s == math.inf:
            self.first_s = time_s
        self.values, self.heard_s = values, time_s
        self._times_s.append(time_s)
        if self._says(values):
            self.said_s = time_s
        return True

    def age_s(self, now_s: float) -> float:
        """inf where nothing ever came."""
        return now_s - self.heard_s

    def mute_s(self, now_s: float) -> float:
        """For how long it has said nothing, whether it spoke or not."""
        return now_s - (self.said_s if self.said_s > -math.inf else self.first_s)

    def rate_hz(self, now_s: float, silent_after_s: float) -> float:
        """As heard over the last seconds; a silence longer than `silent_after_s` counts in."""
        lately = [time_s for time_s in self._times_s if now_s - time_s <= RATE_OVER_S]
        if len(lately) < 2:
            return 0.0
        until_s = now_s if now_s - lately[-1] > silent_after_s else lately[-1]
        return (len(lately) - 1) / (until_s - lately[0]) if until_s > lately[0] else 0.0
