"""The box that connects a vehicle: the ways that there are, or a link that is typed."""

from collections.abc import Sequence
from typing import ClassVar

from textual.app import ComposeResult
from textual.containers import Vertical
from textual.widgets import Input

from bridge.errors import LinkSpecError
from bridge.links.addresses import parse_link, same_link
from tui.app.connecting import Choice, Way
from tui.app.drawing import Line, Lines, Role, cut, wrapped
from tui.app.header import PHONE
from tui.app.keys import HIDDEN, LOOKS, Action, bindings
from tui.app.screens.frame import Drawn
from tui.app.screens.overlays import OverScreen
from tui.app.themes import ROLE_CLASSES

CONNECTING = (
    Action(
        "connect.cancel", "escape", "Cancel", "back, and nothing is changed", HIDDEN | LOOKS, "dismiss(None)"
    ),
    Action("connect.look", "ctrl+r", "Look only", "show this link, and record nothing", HIDDEN, "look"),
    Action("connect.next", "down", "Next", "the next way", HIDDEN | LOOKS, "go(1)"),
    Action("connect.before", "up", "Before", "the way before", HIDDEN | LOOKS, "go(-1)"),
)
LINK_CELLS = 34
OTHERS = "this app goes by another recording; end that one first, or see this one by `seatrial watch --link`"


def way_lines(ways: Sequence[Way], at: int, trouble: str, cells: int) -> Lines:
    """A line per way, that at `at` marked; below them the fault of the link typed."""
    widest = min(max((len(way.link) for way in ways), default=0), LINK_CELLS)
    link_cells = LINK_CELLS if cells >= PHONE else widest
    return (
        *(_line(way, n == at, link_cells, cells) for n, way in enumerate(ways)),
        *_trouble(trouble, cells),
    )


def _line(way: Way, is_at: bool, link_cells: int, cells: int) -> Line:
    role: Role = "strong" if is_at else "plain"
    mark = "●" if way.recorded else " "
    link = cut(way.link, link_cells)
    head: Line = (("▶" if is_at else " ", "accent"), (f"{mark} ", "accent"), (f"{link:<{link_cells}} ", role))
    return (*head, (cut(way.words, max(cells - link_cells - 4, 1)), "quiet"))


def _trouble(trouble: str, cells: int) -> Lines:
    return wrapped(f"▲ {trouble}", "bad", cells) if trouble else ()


class ConnectScreen(OverScreen[Choice | None]):
    """Returns the choice when Enter sends it; None if the box was closed. A click or arrows choose a way."""

    COMPONENT_CLASSES: ClassVar[set[str]] = set(ROLE_CLASSES)
    BINDINGS = bindings(CONNECTING)  # type: ignore[assignment]

    def __init__(self, ways: Sequence[Way]) -> None:
        super().__init__()
        self._ways, self._at, self._trouble = tuple(ways), 0, ""

    def compose(self) -> ComposeResult:
        first = self._ways[0].link if self._ways else ""
        yield (
            box := Vertical(Drawn(self._lines, pressed=self._press), Input(first, "a link"), id="connect-box")
        )
        box.add_class("box")
        box.border_title = "Connect a vehicle: one of these, or type"
        box.border_subtitle = "enter records, Ctrl-R only looks, escape leaves"

    def _lines(self, cells: int, _: int) -> Lines:
        return way_lines(self._ways, self._at, self._trouble, cells)

    def action_go(self, rows: int) -> None:
        self._to(max(0, min(self._at + rows, len(self._ways) - 1)))

    def _press(self, _: int, y: int) -> None:
        if y < len(self._ways):
            self._to(y)

    def _to(self, at: int) -> None:
        self._at, self._trouble = at, ""
        self.query_one(Input).value = self._ways[at].link
        self._draw()

    def on_input_submitted(self, event: Input.Submitted) -> None:
        self._take(event.value.strip(), records=True)

    def action_look(self) -> None:
        self._take(self.query_one(Input).value.strip(), records=False)

    def _take(self, link: str, *, records: bool) -> None:
        way = next((way for way in self._ways if same_link(way.link, link)), None)
        try:
            parse_link(link)
        except LinkSpecError as error:
            self._trouble = str(error)
        else:
            self._trouble = OTHERS if way is not None and way.others else ""
        if self._trouble:
            self._draw()
        else:
            self.dismiss(Choice(link, records or (way is not None and way.recorded)))

    def _draw(self) -> None:
        self.query_one(Drawn).again()
        self.ask_for_room()
