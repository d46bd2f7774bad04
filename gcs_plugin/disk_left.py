"""Time until the disk is full at the rate of the recording, and a warning before that."""

from collections.abc import Callable
from typing import Final

LOOK_EVERY_S: Final = 2.0
WARN_S: Final = 600.0
LEAST_FREE_BYTES: Final = 1_000_000
MEAN_OVER_S: Final = 60.0
"""Averaging time of the rate for `left_s`; periods without data do not count."""


class DiskLeft:
    """Watches the free space of the recording's disk.

    `free_bytes` returns the free space on the disk, or raises OSError; `warn` is called with a sentence. `left_s` is
    the time until the disk is full at the rate of the arriving bytes, written or not; inf if nothing arrives.
    """

    def __init__(self, free_bytes: Callable[[], int], warn: Callable[[str], None], now_s: float) -> None:
        self._free_bytes, self._warn = free_bytes, warn
        self._due_s = self._looked_s = now_s
        self._bytes = 0
        self._is_short = False
        self._mean_rate = self._came_for_s = 0.0
        self.left_s = float("inf")

    @property
    def has_room(self) -> bool:
        """Whether there is room to begin another file."""
        return (self._space() or 0) >= LEAST_FREE_BYTES

    def came(self, count: int) -> None:
        """`count` bytes arrived over a link."""
        self._bytes += count

    def look(self, now_s: float) -> None:
        """Update `left_s` and warn if the disk is nearly full; does so every LOOK_EVERY_S."""
        if now_s < self._due_s:
            return
        self._due_s = now_s + LOOK_EVERY_S
        span_s = now_s - self._looked_s
        if span_s <= 0:
            return
        rate = self._bytes / span_s
        self._looked_s, self._bytes = now_s, 0
        free = self._space()
        if free is None:
            return
        left_s = free / rate if rate > 0 else float("inf")
        if rate > 0:  # a silence does not change the rate at which bytes arrive after it
            self._came_for_s = min(self._came_for_s + span_s, MEAN_OVER_S)
            self._mean_rate += min(span_s / self._came_for_s, 1.0) * (rate - self._mean_rate)
        self.left_s = free / self._mean_rate if rate > 0 else float("inf")
        short = left_s < WARN_S or free < LEAST_FREE_BYTES
        if short and not self._is_short:
            minutes = f"about {left_s / 60:.0f} min of recording" if rate > 0 else "next to nothing"
            self._warn(f"the disk has {free / 1e6:.1f} MB left, {minutes}; free some space")
        self._is_short = short

    def _space(self) -> int | None:
        """Free bytes; None if the disk is not there, which the writer of the files reports."""
        try:
            return self._free_bytes()
        except OSError:
            return None
