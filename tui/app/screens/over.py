"""Base of boxes over a screen that ask something and hide none of it: the screen below makes room."""

from typing import TypeVar

from textual import events
from textual.screen import ModalScreen

from tui.app.screens.frame import StationScreen
from tui.app.widgets.top_line import TopLine

Answer = TypeVar("Answer")
LEAST_ABOVE = 3
"""Rows above the box: the lines on top, and one for a banner that may appear."""


class OverScreen(ModalScreen[Answer]):
    """Subclasses compose one box, of the class `box`."""

    _below: StationScreen | None = None

    def on_mount(self) -> None:
        below = self.app.screen_stack[0]
        self._below = below if isinstance(below, StationScreen) else None
        for top in below.query(TopLine):
            self.watch(top, "virtual_size", self.ask_for_room)

    def on_resize(self, _: events.Resize) -> None:
        self.ask_for_room()

    def on_unmount(self) -> None:
        if self._below is not None:
            self._below.make_room(0)

    def ask_for_room(self) -> None:
        """Move the screen below under the box, once the box has its size."""
        self.call_after_refresh(self._make_room)

    def _make_room(self) -> None:
        if self._below is None or not self.is_current:
            return
        box = self.query_one(".box")
        above = max([LEAST_ABOVE, *(top.region.bottom for top in self._below.query(TopLine))])
        if box.styles.margin.top != above:
            # The banner's second line must not be hidden.
            box.styles.margin = (above, 0, box.styles.margin.bottom, 0)
        self._below.make_room(above + box.region.height)
