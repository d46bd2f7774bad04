"""The lines on top of every screen; a click on a title opens its screen."""

from collections.abc import Sequence
from dataclasses import dataclass

from textual import events
from textual.message import Message

from tui.app.header import Tab, header, tab_at
from tui.app.lines import Lines
from tui.app.view import View
from tui.app.widgets.line_view import LineView

TABS_AT = 1


class TopLine(LineView):
    """Armed state, link, recording, feed-forward, UTC; the screens; alerts."""

    @dataclass
    class Chosen(Message):
        """A screen's title was clicked."""

        tab: Tab

    def __init__(self, tabs: Sequence[Tab]) -> None:
        super().__init__()
        self._tabs = tabs

    def lines(self, view: View, cells: int, rows: int) -> Lines:
        del rows
        return header(view, self._tabs, cells)

    def on_click(self, event: events.Click) -> None:
        tab = tab_at(self._tabs, event.x) if event.y == TABS_AT else None
        if tab is not None:
            self.post_message(self.Chosen(tab))
