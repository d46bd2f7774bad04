"""Limits how often something may be done."""

from typing import Final

TELL_EVERY_S: Final = 10.0


class Pace:
    """Allows `burst` actions at once, and `rate_hz` a second in the long run."""

    def __init__(self, rate_hz: float, burst: int, now_s: float) -> None:
        self._rate_hz, self._burst = rate_hz, burst
        self._left, self._asked_s, self._tell_s = float(burst), now_s, now_s

    def allows(self, now_s: float) -> bool:
        """Whether one more action is allowed now; an allowed action is counted."""
        earned = (now_s - self._asked_s) * self._rate_hz
        self._left, self._asked_s = min(float(self._burst), self._left + earned), now_s
        if self._left < 1.0:
            return False
        self._left -= 1.0
        return True

    def to_be_told(self, now_s: float) -> bool:
        """Whether to tell the crew now that the limit was exceeded: at most once every `TELL_EVERY_S`."""
        if now_s < self._tell_s:
            return False
        self._tell_s = now_s + TELL_EVERY_S
        return True
