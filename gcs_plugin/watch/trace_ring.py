"""The last minute of a quantity, thinned to MOST_HZ, in arrays of fixed size."""

import math
from typing import Final

import numpy as np

from bridge.arrays import Array

KEPT_S: Final = 60.0
MOST_HZ: Final = 20.0
STEP_S: Final = 1.0 / MOST_HZ
SLOTS: Final = 1 + round(KEPT_S * MOST_HZ)


class TraceRing:
    """A ring of values with their times and references; of several values within a step, the newest is kept."""

    __slots__ = ("_count", "_reference", "_slot", "_step_ends_s", "_time_s", "_value", "last_s")

    def __init__(self) -> None:
        self.last_s = -math.inf
        self._time_s = np.full(SLOTS, np.nan)
        self._value = np.full(SLOTS, np.nan)
        self._reference = np.full(SLOTS, np.nan)
        self._slot, self._count = SLOTS - 1, 0
        self._step_ends_s = -math.inf

    def put(self, time_s: float, value: float, reference: float = math.nan) -> None:
        """Add a value that came at `time_s`; a time earlier than the previous value's counts as equal to it."""
        time_s = max(time_s, self.last_s)
        if time_s >= self._step_ends_s:
            self._step_ends_s = time_s + STEP_S
            self._slot = (self._slot + 1) % SLOTS
            self._count = min(self._count + 1, SLOTS)
        slot = self._slot
        self._time_s[slot], self._value[slot], self._reference[slot] = time_s, value, reference
        self.last_s = time_s

    def since(self, start_s: float) -> tuple[Array, Array, Array | None]:
        """Times, values and references from `start_s` on; the references are None if none is known."""
        first = (self._slot + 1 - self._count) % SLOTS
        order = np.arange(first, first + self._count) % SLOTS
        time_s = self._time_s[order]
        order = order[np.searchsorted(time_s, start_s) :]
        reference = self._reference[order]
        has_reference = np.isfinite(reference).any()
        return self._time_s[order], self._value[order], reference if has_reference else None

    def known_share(self, start_s: float) -> float:
        """Share of the values from `start_s` on that are numbers; NaN if there are no values."""
        _, value, _ = self.since(start_s)
        return float(np.isfinite(value).mean()) if len(value) else math.nan
