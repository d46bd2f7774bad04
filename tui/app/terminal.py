"""A terminal that says how far it has come: asked for its cursor after what was drawn, it answers once it is there."""

from collections.abc import Callable
from typing import Any, Final

from textual import events
from textual.drivers.linux_driver import LinuxDriver
from textual.message import Message

WHERE_IS_THE_CURSOR: Final = "\x1b[6n"


class AnsweringDriver(LinuxDriver):
    """The driver of a terminal; `answered` is called, in the driver's thread, at each answer."""

    def __init__(self, *of_driver: Any, **named: Any) -> None:
        super().__init__(*of_driver, **named)
        self.answered: Callable[[], object] = lambda: None

    def ask(self) -> None:
        """To be answered when all that was written before is shown."""
        self.write(WHERE_IS_THE_CURSOR)

    def process_message(self, message: Message) -> None:
        if isinstance(message, events.CursorPosition):
            self.answered()
            return
        super().process_message(message)
