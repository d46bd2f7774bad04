"""How long the disk lasts for what is being recorded, and a warning before it is full."""

from collections.abc import Callable
from typing import Final

LOOK_EVERY_S: Final = 2.0
WARN_S: Final = 600.0
LEAST_FREE_BYTES: Final = 1_000_000
RATE_SHARE: Final = 0.1
"""Of the newest look, in the mean rate that the time left is told by."""


class DiskLeft:
    """`free_bytes` tells the space left where the files lie, or raises OSError; `warn` hears a sentence.

    `left_s` is how long the disk lasts, inf where nothing is written.
    """

    def __init__(self, free_bytes: Callable[[], int], warn: Callable[[str], None], now_s: float) -> None:
        self._free_bytes, self._warn = free_bytes, warn
        self._due_s = self._looked_s = now_s
        self._bytes = 0
        self._is_short = False
        self._mean_rate = 0.0
        self.left_s = float("inf")

    @property
    def has_room(self) -> bool:
        """Whether another file may be begun."""
        return self._space() >= LEAST_FREE_BYTES

    def begin_anew(self, written_bytes: int) -> None:
        """From now on the count of bytes begins at 0 again; it stands at this."""
        self._bytes -= written_bytes

    def look(self, written_bytes: int, now_s: float) -> None:
        """So much has been written by now."""
        if now_s < self._due_s:
            return
        self._due_s = now_s + LOOK_EVERY_S
        span_s = now_s - self._looked_s
        if span_s <= 0:
            return
        rate = (written_bytes - self._bytes) / span_s
        self._looked_s, self._bytes = now_s, written_bytes
        free = self._space()
        left_s = free / rate if rate > 0 else float("inf")
        self._mean_rate += RATE_SHARE * (rate - self._mean_rate) if self._mean_rate > 0 else rate
        self.left_s = free / self._mean_rate if rate > 0 else float("inf")
        short = left_s < WARN_S or free < LEAST_FREE_BYTES
        if short and not self._is_short:
            minutes = f"about {left_s / 60:.0f} min of recording" if rate > 0 else "next to nothing"
            self._warn(f"the disk has {free / 1e6:.1f} MB left, {minutes}; free some space")
        self._is_short = short

    def _space(self) -> int:
        """Bytes left for files; none on a disk that is not there."""
        try:
            return self._free_bytes()
        except OSError:
            return 0
