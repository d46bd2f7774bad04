"""Lines to type into, each with a title, over a screen whose top line stays bright and live."""

from collections.abc import Callable, Mapping
from typing import Final

from textual.app import ComposeResult
from textual.containers import Horizontal, VerticalScroll
from textual.widgets import Input, Label

from bridge.errors import SeatrialError
from tui.app.actions import Action, bindings
from tui.app.screens.over import OverScreen

FILLING: Final = (
    Action(
        "form.cancel",
        "escape",
        "dismiss(None)",
        "Cancel",
        "back, and nothing is changed",
        in_footer=False,
        looks=True,
    ),
    Action("form.next", "down", "app.focus_next", "Next", "the next line", in_footer=False, looks=True),
    Action(
        "form.before", "up", "app.focus_previous", "Before", "the line before", in_footer=False, looks=True
    ),
)

UNKEPT: Final = "unkept"


class FormScreen(OverScreen[None]):
    """Saves the texts of all lines, by name, when Enter is pressed in any line; it stays open until that succeeds.

    `titles` and `texts` are by name. `mistakes` returns the faults of texts by name: a fault stands below its line
    from the moment that the line is left until it is corrected. `keep` raises SeatrialError if the texts can't be
    saved, and that is shown too.
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
                    yield Label(title, markup=False)
                    yield Input(self._texts.get(name, ""), "--", name=name, select_on_focus=False)
                yield _Trouble(name)
            yield _Trouble(UNKEPT)
        box.border_title = self._asked
        box.border_subtitle = "enter keeps all, escape leaves it, arrows go on"

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
