"""One quantity over the last minute; in a single row, a value with blocks."""

from tui.app.chart import chart
from tui.app.lines import Lines
from tui.app.quantities import Quantity
from tui.app.view import View
from tui.app.widgets.line_view import LineView


class StripChart(LineView):
    """The chart of one quantity, filling the widget."""

    def __init__(self, quantity: Quantity, *, classes: str | None = None) -> None:
        super().__init__(id=f"chart-{quantity.key}", classes=classes)
        self.quantity = quantity

    def lines(self, view: View, cells: int, rows: int) -> Lines:
        picture = view.picture
        return chart(self.quantity, picture.traces.get(self.quantity.key), picture.now_s, cells, rows)
