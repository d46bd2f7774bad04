"""Drawing rate: as requested, once a second if the terminal lags, and paused while it is far behind. Pure logic.

After each drawing the terminal gets a small query, which it answers when it has drawn everything before. A terminal
that never answers is assumed to keep up.
"""

from typing import Final

LATE_S: Final = 0.5
LAGGING_PERIOD_S: Final = 1.0
CALM_S: Final = 5.0  # without a late answer, before the requested rate resumes
GIVEN_UP_S: Final = 5.0


class Pace:
    """`fps` is the number of refreshes a second when everything keeps up."""

    def __init__(self, fps: float) -> None:
        self._period_s = 1.0 / fps
        self._asked_s: float | None = None
        self._slow_until_s = float("-inf")
        self._ever_answered = False

    def may_ask(self) -> bool:
        """Whether the last query is answered."""
        return self._asked_s is None

    def on_asked(self, now_s: float) -> None:
        self._asked_s = now_s

    def on_answered(self, now_s: float) -> None:
        if self._asked_s is not None and now_s - self._asked_s > LATE_S:
            self._slow_until_s = now_s + CALM_S
        self._asked_s, self._ever_answered = None, True

    def may_draw(self, now_s: float) -> bool:
        """Whether the terminal is ready for more; after a long wait it is tried anyway."""
        waiting_s = 0.0 if self._asked_s is None else now_s - self._asked_s
        if waiting_s <= LATE_S or not self._ever_answered:
            return True
        self._slow_until_s = now_s + CALM_S
        if waiting_s > GIVEN_UP_S:
            self._asked_s = None
            return True
        return False

    def period_s(self, now_s: float) -> float:
        """Time to the next refresh, s."""
        if now_s < self._slow_until_s:
            return max(LAGGING_PERIOD_S, self._period_s)
        return self._period_s
