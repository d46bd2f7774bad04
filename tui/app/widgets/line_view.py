"""A widget that shows lines with roles, and draws again only those that changed."""

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
    """Subclasses say which lines a view is, for so many cells and rows. Its screen has the classes of the roles."""

    def __init__(self, *, id: str | None = None, classes: str | None = None) -> None:
        super().__init__(id=id, classes=classes)
        self._view: View | None = None
        self._lines: Lines = ()

    def lines(self, view: View, cells: int, rows: int) -> Lines:
        raise NotImplementedError

    @property
    def view(self) -> View | None:
        """What is shown."""
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
                # On a slow link a few digits are a tenth of a row.
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
        """One span; what only fills at its ends is not underlined."""
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
            # What was hidden comes back as high as it was, though it has other lines by now.
            self.refresh(layout=bool(self.styles.auto_dimensions and len(self._lines) != self.size.height))

    def on_show(self, _: events.Show) -> None:
        if self._view is not None:
            self.show(self._view)
