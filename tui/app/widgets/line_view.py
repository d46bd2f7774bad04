"""A widget that shows lines with roles, and redraws only those that changed."""

from collections.abc import Iterator
from itertools import zip_longest
from typing import Final

from rich.segment import Segment
from rich.style import Style
from textual import events
from textual.geometry import Region, Size
from textual.strip import Strip
from textual.widget import Widget

from tui.app.lines import Lines, Role, changed, harmless
from tui.app.view import View

NOT_UNDERLINED: Final = Style(underline=False)


class LineView(Widget):
    """Subclasses turn a view into lines for that many cells and rows. The screen holds the roles' component classes."""

    def __init__(self, *, id: str | None = None, classes: str | None = None) -> None:
        super().__init__(id=id, classes=classes)
        self._view: View | None = None
        self._lines: Lines = ()

    def lines(self, view: View, cells: int, rows: int) -> Lines:
        raise NotImplementedError

    @property
    def view(self) -> View | None:
        """The view shown now."""
        return self._view

    def show(self, view: View) -> None:
        """Show a newer view."""
        self._view = view
        if not self.size or not self.is_on_screen:
            return
        before, self._lines = self._lines, self.lines(view, self.size.width, self.size.height)
        if len(before) != len(self._lines) and self.styles.auto_dimensions:
            self.refresh(layout=True)
            return
        for y, (old, new) in enumerate(zip_longest(before, self._lines, fillvalue=())):
            if old != new:
                # Redraw only the changed digits: on a slow link, they are a tenth of the row.
                start, end = changed(old, new)
                self.refresh(Region(start, y, end - start, 1))

    def get_content_height(self, container: Size, viewport: Size, width: int) -> int:
        del container, viewport
        return len(self.lines(self._view, width, 0)) if self._view is not None else 1

    def render_line(self, y: int) -> Strip:
        base = self.rich_style
        spans = self._lines[y] if y < len(self._lines) else ()
        segments = [segment for text, role in spans for segment in self._segments(text, role)]
        return Strip(segments).adjust_cell_length(self.size.width, base)

    def _segments(self, text: str, role: Role) -> Iterator[Segment]:
        """Segments of one span; leading and trailing blanks are not underlined."""
        text = harmless(text)
        style = self.screen.get_component_rich_style(f"line--{role}")
        bare = text.strip() if style.underline else text
        before, _, after = text.partition(bare) if bare else (text, "", "")
        unmarked = style + NOT_UNDERLINED
        yield from (
            Segment(part, kind)
            for part, kind in ((before, unmarked), (bare, style), (after, unmarked))
            if part
        )

    def on_resize(self, _: events.Resize) -> None:
        if self._view is not None:
            self._lines = self.lines(self._view, self.size.width, self.size.height)
            # A hidden widget returns with its old height, though its number of lines may have changed.
            self.refresh(layout=bool(self.styles.auto_dimensions and len(self._lines) != self.size.height))

    def on_show(self, _: events.Show) -> None:
        if self._view is not None:
            self.show(self._view)
