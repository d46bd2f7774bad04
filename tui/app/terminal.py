"""Terminal driver that measures the terminal's lag: a cursor query after the output is answered once that is drawn."""

import os
import termios
from collections.abc import Callable
from contextlib import suppress
from typing import Any, Final

from textual import events
from textual.drivers.linux_driver import LinuxDriver
from textual.message import Message

WHERE_IS_THE_CURSOR: Final = "\x1b[6n"
AS_BEFORE: Final = "".join(f"\x1b[?{mode}l" for mode in (1000, 1002, 1003, 1006, 2004, 1004)) + "\x1b[<u"
"""Switch off mouse, bracketed paste and focus reports, and restore the keyboard mode."""
OTHER_SCREEN: Final = "\x1b[?1049l\x1b[?25h"
"""Return to the previous screen, with its cursor."""


class AnsweringDriver(LinuxDriver):
    """Driver of a terminal; `answered` is called, in the driver's thread, at each answer."""

    def __init__(self, *of_driver: Any, **named: Any) -> None:
        super().__init__(*of_driver, **named)
        self.answered: Callable[[], object] = lambda: None
        self._given_back = False

    def ask(self) -> None:
        """Query the cursor; the answer comes when all earlier output is shown."""
        self.write(WHERE_IS_THE_CURSOR)

    def process_message(self, message: Message) -> None:
        if isinstance(message, events.CursorPosition):
            self.answered()
            return
        super().process_message(message)

    def start_application_mode(self) -> None:
        super().start_application_mode()  # type: ignore[no-untyped-call]
        self._given_back = False

    def stop_application_mode(self) -> None:
        super().stop_application_mode()
        self._given_back = True

    def _sigcont_application(self, *_: object) -> None:
        """Resume after a stop. After SIGSTOP, which gives no warning, the old threads still live: Textual would start
        more of them, and all would read the keys.
        """
        if not self._auto_restart or self._must_signal_resume:
            super()._sigcont_application()
            return
        as_found = self.attrs_before
        self._end_threads()
        super()._sigcont_application()
        self.attrs_before = as_found

    def _end_threads(self) -> None:
        self.exit_event.set()
        if self._key_thread is not None:
            self._key_thread.join()
        self.exit_event.clear()
        self.close()

    def give_back(self, sentence: str) -> None:
        """Restore the terminal and print a last sentence, bypassing anything that may hang; do so only once."""
        if self._given_back:
            return
        with suppress(OSError, termios.error):
            if self.attrs_before is not None:
                termios.tcsetattr(self.fileno, termios.TCSANOW, self.attrs_before)
            os.write(self.fileno, f"{AS_BEFORE}{OTHER_SCREEN}{sentence}\n".encode())
