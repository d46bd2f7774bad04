"""What lies over a screen and asks, and hides none of it: the screen below makes room."""

from typing import TypeVar

from textual import events
from textual.screen import ModalScreen

from tui.app.screens.frame import StationScreen

Answer = TypeVar("Answer")


class OverScreen(ModalScreen[Answer]):
    """Subclasses compose one box, of the class `box`."""

    _below: StationScreen | None = None

    def on_mount(self) -> None:
        below = self.app.screen_stack[0]
        self._below = below if isinstance(below, StationScreen) else None

    def on_resize(self, _: events.Resize) -> None:
        self.ask_for_room()

    def on_unmount(self) -> None:
        if self._below is not None:
            self._below.make_room(0)

    def ask_for_room(self) -> None:
        """Have the screen below begin under the box, once that has its size."""
        self.call_after_refresh(self._make_room)

    def _make_room(self) -> None:
        if self._below is not None and self.is_current:
            self._below.make_room(self.query_one(".box").region.bottom)
