"""A channel for each signal: who sends it, how often, and since when it has no value, among any number of sources."""

import math
from collections import deque
from collections.abc import Callable
from typing import Final

from gcs_plugin.watch.hearing import Values

TIMES_KEPT: Final = 64
RATE_OVER_S: Final = 10.0
YIELDS_AFTER_S: Final = 3.0
"""A source silent for this long loses its signal to the next one, even if that is worse."""

Teller = tuple[int, int]
"""Rank and component of a source."""


class Channel:
    """The last values of a signal. `says` tests whether values are valid.

    `said_s` is when they last were, `heard_s` when anything last came, `first_s` when anything first came.
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
        """Take values from the present source, from a better one, or from any if the present one is silent.

        Return whether the values were taken.
        """
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
        """Time since the last values; inf if none ever came."""
        return now_s - self.heard_s

    def mute_s(self, now_s: float) -> float:
        """Time without valid values, even if other values came."""
        return now_s - (self.said_s if self.said_s > -math.inf else self.first_s)

    def rate_hz(self, now_s: float, silent_after_s: float) -> float:
        """Rate over the last seconds; a silence longer than `silent_after_s` lowers it."""
        recent_s = [time_s for time_s in self._times_s if now_s - time_s <= RATE_OVER_S]
        if len(recent_s) < 2:
            return 0.0
        until_s = now_s if now_s - recent_s[-1] > silent_after_s else recent_s[-1]
        return (len(recent_s) - 1) / (until_s - recent_s[0]) if until_s > recent_s[0] else 0.0
