"""Bar that marks a replay, with the position in it and the keys that move it."""

from collections.abc import Callable

from tui.app.lines import Lines, cut
from tui.app.replay import bar
from tui.app.view import View
from tui.app.widgets.line_view import LineView


class ReplayBar(LineView):
    """Two lines; `keys` returns the keys that work."""

    def __init__(self, keys: Callable[[], str]) -> None:
        super().__init__(id="replay-bar")
        self._keys = keys

    def lines(self, view: View, cells: int, rows: int) -> Lines:
        del rows
        if view.replay is None:
            return ()
        return (bar(view.replay, cells), ((cut(f" {self._keys()}", cells), "quiet"),))
