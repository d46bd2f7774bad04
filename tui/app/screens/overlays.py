"""Help, questions and forms over a screen, whose top line stays bright and live; and a question below it."""

from collections.abc import Callable, Mapping, Sequence
from functools import cache
from typing import Any, ClassVar, Final, TypeVar

from textual import events
from textual.app import App, ComposeResult
from textual.binding import Binding
from textual.containers import Horizontal, Vertical, VerticalScroll
from textual.screen import ModalScreen, Screen
from textual.widgets import Input, Label, Static

from bridge.errors import SeatrialError
from tui.app.drawing import Line, Lines, Role, with_head, wrapped
from tui.app.keys import HIDDEN, LOOKS, Action, bindings
from tui.app.screens.frame import Drawn, StationScreen, TopLine
from tui.app.themes import ROLE_CLASSES

Answer = TypeVar("Answer")
LEAST_ABOVE = 3
"""Rows above the box: the lines on top, and one for a banner that may appear."""

ASKING: Final = (
    Action("ask.cancel", "escape", "Cancel", "back, and nothing is changed", HIDDEN | LOOKS, "dismiss(None)"),
)
FILLING: Final = (
    Action(
        "form.cancel", "escape", "Cancel", "back, and nothing is changed", HIDDEN | LOOKS, "dismiss(None)"
    ),
    Action("form.next", "down", "Next", "the next line", HIDDEN | LOOKS, "app.focus_next"),
    Action("form.before", "up", "Before", "the line before", HIDDEN | LOOKS, "app.focus_previous"),
)
CLOSING: Final = (
    Action(
        "help.close", "escape,question_mark,f1,q", "Close", "back to the screen", HIDDEN | LOOKS, "dismiss"
    ),
)
EVERYWHERE, MOVING = "Everywhere", "Moving about"
KEY_CELLS, WORD_CELLS, CELLS, NARROW_INDENT = 13, 9, 68, 4
UNKEPT: Final = "unkept"


def keep_below_top(overlay: Screen[Any], box: str) -> None:
    """Keep the box that `box` selects below the lines on top of the screen under it, however many rows they take."""

    def place() -> None:
        tops = overlay.app.screen_stack[0].query(TopLine)
        above = max((top.region.bottom for top in tops), default=0)
        for over in overlay.query(box):
            if over.styles.margin.top != above:
                over.styles.margin = (above, 0, over.styles.margin.bottom, 0)

    def place_soon() -> None:
        overlay.call_after_refresh(place)

    # At once as well: a box that moves after its first drawing costs a second one.
    place()
    for top in overlay.app.screen_stack[0].query(TopLine):
        overlay.watch(top, "virtual_size", place_soon, init=False)


class Overlay(ModalScreen[Answer]):
    """Laid out and styled once as it opens: each time more would draw both screens again."""

    def on_screen_resume(self, event: events.ScreenResume) -> None:
        event.refresh_styles = False

    def on_resize(self, event: events.Resize) -> None:
        if event.size == self.size:
            event.prevent_default()


class OverScreen(Overlay[Answer]):
    """A box over a screen. Subclasses compose it, with the class `box`."""

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


class AskScreen(OverScreen[str | None]):
    """Asks for a text; None if it was closed. `does` tells the effect of Enter, `choices` which texts are known."""

    BINDINGS = bindings(ASKING)  # type: ignore[assignment]

    def __init__(self, title: str, does: str, choices: Sequence[str] = ()) -> None:
        super().__init__()
        self._asked, self._does, self._choices = title, does, choices

    def compose(self) -> ComposeResult:
        known = (Static(", ".join(self._choices), markup=False),) if self._choices else ()
        box = Vertical(*known, Input(), id="ask-box", classes="box")
        box.border_title = self._asked
        box.border_subtitle = f"enter {self._does}, escape leaves it"
        yield box

    def on_input_submitted(self, event: Input.Submitted) -> None:
        self.dismiss(event.value)


class FormScreen(OverScreen[None]):
    """Saves the texts of all lines, by name, when Enter is pressed in any line; it stays open until that succeeds.

    `titles` and `texts` are by name; a line without a title has the whole width. `mistakes` returns the faults of texts
    by name: a fault stands below its line, from the start or from the moment that the line is left, until it is
    corrected. `keep` raises SeatrialError if the texts can't be saved, and that is shown too.
    """

    BINDINGS = bindings(FILLING)  # type: ignore[assignment]

    def __init__(
        self,
        title: str,
        titles: Mapping[str, str],
        texts: Mapping[str, str],
        mistakes: Callable[[Mapping[str, str]], Mapping[str, str]],
        keep: Callable[[Mapping[str, str]], None],
    ) -> None:
        super().__init__()
        self._asked, self._titles, self._texts = title, titles, texts
        self._mistakes, self._keep = mistakes, keep

    def compose(self) -> ComposeResult:
        with VerticalScroll(id="form-box", classes="box", can_focus=False) as box:
            for name, title in self._titles.items():
                with Horizontal(classes="form-line"):
                    if title:
                        yield Label(title, markup=False)
                    yield Input(self._texts.get(name, ""), "--", name=name, select_on_focus=False)
                yield _Trouble(name)
            yield _Trouble(UNKEPT)
        box.border_title = self._asked
        box.border_subtitle = "enter keeps all, escape leaves it, arrows go on"

    def on_mount(self) -> None:
        for name in self._titles:
            if self._texts.get(name):
                self._judge(name)

    def on_input_blurred(self, event: Input.Blurred) -> None:
        self._judge(str(event.input.name))

    def on_input_changed(self, event: Input.Changed) -> None:
        name = str(event.input.name)
        if self._trouble(name).display:
            self._judge(name)

    def on_input_submitted(self) -> None:
        for name in self._titles:
            self._judge(name)
        faulty = next((line for line in self.query(Input) if self._trouble(str(line.name)).display), None)
        if faulty is not None:
            faulty.focus()
            return
        try:
            self._keep(self._typed())
        except SeatrialError as error:
            self._trouble(UNKEPT).say(str(error))
            self.ask_for_room()
        else:
            self.dismiss()

    def _typed(self) -> dict[str, str]:
        return {str(line.name): line.value for line in self.query(Input)}

    def _judge(self, name: str) -> None:
        self._trouble(name).say(self._mistakes(self._typed()).get(name, ""))
        self.ask_for_room()

    def _trouble(self, name: str) -> "_Trouble":
        return self.query_one(f"#trouble-{name}", _Trouble)


class _Trouble(Label):
    """A fault, visible only while it exists."""

    def __init__(self, of: str) -> None:
        super().__init__("", id=f"trouble-{of}", classes="trouble", markup=False)
        self.display = False

    def say(self, sentence: str) -> None:
        self.update(f"▲ {sentence}")
        self.display = bool(sentence)


class AskLine(Vertical):
    """A question below the screen, with a line to type. `question(cells, rows)` makes its words; Enter sends the typed
    text as `Input.Submitted`."""

    def __init__(self, question: Callable[[int, int], Lines], *, id: str) -> None:
        super().__init__(id=id)
        self._question = question
        self._line = Input(select_on_focus=False, disabled=True)
        self.is_open = False

    def compose(self) -> ComposeResult:
        yield Drawn(self._question)
        yield self._line

    def open(self) -> None:
        """Show the line, empty, and take typed keys from now on."""
        self.close()
        self.is_open = True
        self.add_class("-open")
        self._line.disabled = False
        # Only a drawn widget can have the focus.
        self.screen.call_after_refresh(self.screen.set_focus, self._line)

    def close(self) -> None:
        """Hide the line and forget its text."""
        self.is_open = False
        self.remove_class("-open")
        self.empty()
        self._line.disabled = True
        self.screen.set_focus(None)

    def empty(self) -> None:
        self._line.value = ""


class HelpScreen(Overlay[None]):
    """A box over the screen; the top line stays bright and live."""

    COMPONENT_CLASSES: ClassVar[set[str]] = set(ROLE_CLASSES)
    BINDINGS = bindings(CLOSING)  # type: ignore[assignment]

    def __init__(self, lines: Callable[[int], Lines]) -> None:
        super().__init__()
        self._text = lines

    def on_mount(self) -> None:
        keep_below_top(self, "#help-box")
        # A bar that shows only once the text is found too long costs a layout and a drawing of the whole screen.
        if len(self._text(self.app.size.width)) > self.app.size.height:
            self.query_one("#help-box", VerticalScroll).show_vertical_scrollbar = True

    def compose(self) -> ComposeResult:
        box = VerticalScroll(Drawn(lambda cells, _: self._text(cells), id="help-text"), id="help-box")
        box.border_title = "Keys"
        box.border_subtitle = "escape closes"
        yield box


def help_lines(app: App[None], screen: Screen[object]) -> Callable[[int], Lines]:
    """The screen's own keys, those that work everywhere, those of the focused widget, and the meaning of the marks, as
    they are now: a function that gives their lines for a width in cells.
    """
    title = str(screen.title or "")
    groups: dict[str, dict[str, tuple[list[str], Binding]]] = {title: {}, EVERYWHERE: {}, MOVING: {}}
    for node, binding, enabled, _ in screen.active_bindings.values():
        if not enabled or binding.system or not binding.description:
            continue
        group = MOVING if binding.id is None else EVERYWHERE if node is app else title
        keys, _ = groups[group].setdefault(binding.action, ([], binding))
        keys.append(app.get_key_display(binding))
    legend = screen.LEGEND if isinstance(screen, StationScreen) else ()

    def lines(cells: int) -> Lines:
        made: list[Line] = []
        for group, rows in groups.items():
            if group == MOVING and legend:
                made += [
                    (("Marks", "strong"),),
                    *(line for mark in legend for line in _entry(*mark, "", "plain", cells)),
                    (),
                ]
            if rows:
                made.append(((group, "strong"),))
            for keys, binding in rows.values():
                made += _entry(
                    " ".join(dict.fromkeys(keys)), binding.tooltip, binding.description, "quiet", cells
                )
            made.append(())
        return tuple(made[:-1])

    return cache(lines)  # one layout asks several times


def _entry(keys: str, sentence: str, words: str, role: Role, cells: int) -> Lines:
    """Keys or a mark, the words for them, and a sentence at their right, or below on a narrow screen."""
    column = max(WORD_CELLS, len(words) + 1) if words else 0  # a longer name shifts only its own sentence
    head: Line = ((f"  {keys:<{KEY_CELLS}}", "accent"), (f"{words:<{column}}", "plain"))
    if words and cells < CELLS:
        return (head, *wrapped(sentence, role, cells, " " * NARROW_INDENT))
    return with_head(head, sentence, role, cells)
