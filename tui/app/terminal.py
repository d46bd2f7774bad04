"""How fast the terminal draws, and a refresh rate that it can follow.

After each drawing the terminal gets a query for its cursor, which it answers once it has drawn everything before: then
its lag is known, and a slow terminal is drawn on less often. A terminal that never answers is assumed to keep up.
"""

from collections.abc import Callable
from typing import Any, Final

from textual import events
from textual.drivers.linux_driver import LinuxDriver
from textual.message import Message

WHERE_IS_THE_CURSOR: Final = "\x1b[6n"
LATE_S: Final = 0.5
LAGGING_PERIOD_S: Final = 1.0
CALM_S: Final = 5.0  # without a late answer, before the requested rate resumes
GIVEN_UP_S: Final = 5.0


class AnsweringDriver(LinuxDriver):
    """Driver of a terminal; `answered` is called, in the driver's thread, at each answer."""

    def __init__(self, *of_driver: Any, **named: Any) -> None:
        super().__init__(*of_driver, **named)
        self.answered: Callable[[], object] = lambda: None

    def ask(self) -> None:
        """Query the cursor; the answer comes when all earlier output is shown."""
        self.write(WHERE_IS_THE_CURSOR)

    def process_message(self, message: Message) -> None:
        if isinstance(message, events.CursorPosition):
            self.answered()
            return
        super().process_message(message)

    def _sigcont_application(self, *_: object) -> None:
        """Resume after a stop. After SIGSTOP, which gives no warning, the old threads still live: Textual would start
        more of them, and all would read the keys.
        """
        if not self._auto_restart or self._must_signal_resume:
            super()._sigcont_application()
            return
        attributes = self.attrs_before
        self._end_threads()
        super()._sigcont_application()
        self.attrs_before = attributes

    def _end_threads(self) -> None:
        self.exit_event.set()
        if self._key_thread is not None:
            self._key_thread.join()
        self.exit_event.clear()
        self.close()


class RefreshRate:
    """Refresh rate that drops when the terminal lags; `fps` when it keeps up, refreshes a second."""

    def __init__(self, fps: float) -> None:
        self._period_s = 1.0 / fps
        self._asked_s: float | None = None
        self._slow_until_s = float("-inf")
        self._ever_answered = False
        self._patience_s = GIVEN_UP_S

    def may_ask(self) -> bool:
        """Whether the last query is answered."""
        return self._asked_s is None

    def on_asked(self, now_s: float) -> None:
        self._asked_s = now_s

    def on_answered(self, now_s: float) -> None:
        if self._asked_s is not None and now_s - self._asked_s > LATE_S:
            self._slow_until_s = now_s + CALM_S
        self._asked_s, self._ever_answered, self._patience_s = None, True, GIVEN_UP_S

    def may_draw(self, now_s: float) -> bool:
        """Whether the terminal is ready for more; after a long wait it is tried anyway, each time after twice as long.

        Whatever a stalled terminal does not take waits in a short queue; once that is full, the whole app would wait.
        """
        waiting_s = 0.0 if self._asked_s is None else now_s - self._asked_s
        if waiting_s <= LATE_S or not self._ever_answered:
            return True
        self._slow_until_s = now_s + CALM_S
        if waiting_s > self._patience_s:
            self._asked_s, self._patience_s = None, 2 * self._patience_s
            return True
        return False

    def period_s(self, now_s: float) -> float:
        """Time to the next refresh, s."""
        if now_s < self._slow_until_s:
            return max(LAGGING_PERIOD_S, self._period_s)
        return self._period_s
