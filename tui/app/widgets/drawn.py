"""Lines that depend on the state of the screen in addition to the view."""

from collections.abc import Callable

from tui.app.lines import Lines
from tui.app.view import View
from tui.app.widgets.line_view import LineView


class Drawn(LineView):
    """Shows the lines of `make(cells, rows)`, at each new view and whenever `again` is called."""

    def __init__(self, make: Callable[[int, int], Lines], *, id: str | None = None) -> None:
        super().__init__(id=id)
        self._make = make

    def lines(self, view: View, cells: int, rows: int) -> Lines:
        del view
        return self._make(cells, rows)

    def again(self) -> None:
        """Redraw after a change."""
        if self.view is not None:
            self.show(self.view)
