"""Lines that depend on more than the view: on what a screen works on."""

from collections.abc import Callable

from tui.app.lines import Lines
from tui.app.view import View
from tui.app.widgets.line_view import LineView


class Drawn(LineView):
    """Shows what `make(cells, rows)` answers, at each view and when it is told that something changed."""

    def __init__(self, make: Callable[[int, int], Lines], *, id: str | None = None) -> None:
        super().__init__(id=id)
        self._make = make

    def lines(self, view: View, cells: int, rows: int) -> Lines:
        del view
        return self._make(cells, rows)

    def again(self) -> None:
        """Draw what has changed since."""
        if self.view is not None:
            self.show(self.view)
