"""Help: made from the bindings that are live on the screen and the widget below it."""

import textwrap
from collections.abc import Iterator
from typing import ClassVar, Final

from textual.app import App, ComposeResult
from textual.binding import Binding
from textual.containers import VerticalScroll
from textual.screen import ModalScreen, Screen

from tui.app.drawing import Line, Lines
from tui.app.keys import HIDDEN, LOOKS, Action, bindings
from tui.app.screens.frame import LineView, StationScreen
from tui.app.themes import ROLE_CLASSES
from tui.app.view import View

CLOSING: Final = (
    Action(
        "help.close", "escape,question_mark,f1,q", "dismiss", "Close", "back to the screen", HIDDEN | LOOKS
    ),
)
EVERYWHERE, MOVING = "Everywhere", "Moving about"
KEY_CELLS, WORD_CELLS, CELLS = 13, 9, 73


class HelpText(LineView):
    """Lines that depend on no view."""

    def __init__(self, lines: Lines) -> None:
        super().__init__(id="help-text")
        self._lines = lines

    def get_content_height(self, *_: object) -> int:
        return len(self._lines)

    def lines(self, view: View, cells: int, rows: int) -> Lines:
        del view, cells, rows
        return self._lines


class HelpScreen(ModalScreen[None]):
    """A box over the screen; the top line stays bright and live."""

    COMPONENT_CLASSES: ClassVar[set[str]] = set(ROLE_CLASSES)
    BINDINGS = bindings(CLOSING)  # type: ignore[assignment]

    def __init__(self, lines: Lines) -> None:
        super().__init__()
        self._text = lines

    def compose(self) -> ComposeResult:
        box = VerticalScroll(HelpText(self._text), id="help-box")
        box.border_title = "Keys"
        box.border_subtitle = "escape closes"
        yield box


def help_lines(app: App[None], screen: Screen[object]) -> Lines:
    """The screen's own keys, those that work everywhere, those of the focused widget, and the meaning of the marks."""
    title = str(screen.title or "")
    groups: dict[str, dict[str, tuple[list[str], Binding]]] = {title: {}, EVERYWHERE: {}, MOVING: {}}
    for node, binding, enabled, _ in screen.active_bindings.values():
        if not enabled or binding.system or not binding.description:
            continue
        group = MOVING if binding.id is None else EVERYWHERE if node is app else title
        keys, _ = groups[group].setdefault(binding.action, ([], binding))
        keys.append(app.get_key_display(binding))
    lines: list[Line] = []
    for group, rows in groups.items():
        if group == MOVING and isinstance(screen, StationScreen):
            lines += _legend(screen)
        if rows:
            lines.append(((group, "strong"),))
        for keys, binding in rows.values():
            lines += _row(" ".join(dict.fromkeys(keys)), binding.description, binding.tooltip)
        lines.append(())
    return tuple(lines[:-1])


def _legend(screen: StationScreen) -> Iterator[Line]:
    if screen.LEGEND:
        yield (("Marks", "strong"),)
        for mark, meaning in screen.LEGEND:
            head, *further = textwrap.wrap(meaning, CELLS - KEY_CELLS - 2)
            yield ((f"  {mark:<{KEY_CELLS}}", "accent"), (head, "plain"))
            yield from (((" " * (2 + KEY_CELLS), "plain"), (piece, "plain")) for piece in further)
        yield ()


def _row(keys: str, words: str, sentence: str) -> Iterator[Line]:
    column = max(WORD_CELLS, len(words) + 1)  # a longer name shifts only its own sentence
    pieces = textwrap.wrap(sentence, CELLS - KEY_CELLS - column - 2) or [""]
    head: Line = ((f"  {keys:<{KEY_CELLS}}", "accent"), (f"{words:<{column}}", "plain"))
    yield (*head, (pieces[0], "quiet"))
    for piece in pieces[1:]:
        yield ((" " * (2 + KEY_CELLS + column), "plain"), (piece, "quiet"))
