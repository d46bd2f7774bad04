"""How often the ground may make the vehicle do something, such as store parameters."""

from typing import Final

REPORT_EVERY_S: Final = 10.0


class RateLimit:
    """Allows `burst` actions at once, and `rate_hz` a second in the long run."""

    def __init__(self, rate_hz: float, burst: int, now_s: float) -> None:
        self._rate_hz, self._burst = rate_hz, burst
        self._left, self._asked_s, self._report_s = float(burst), now_s, now_s

    def allows(self, now_s: float) -> bool:
        """Whether one more action is allowed now; an allowed action is counted."""
        earned = (now_s - self._asked_s) * self._rate_hz
        self._left, self._asked_s = min(float(self._burst), self._left + earned), now_s
        if self._left < 1.0:
            return False
        self._left -= 1.0
        return True

    def to_be_reported(self, now_s: float) -> bool:
        """Whether to report now that the limit was exceeded: at most once every `REPORT_EVERY_S`."""
        if now_s < self._report_s:
            return False
        self._report_s = now_s + REPORT_EVERY_S
        return True
