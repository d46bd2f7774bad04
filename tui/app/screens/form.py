"""Lines to type, each under its title, over a screen whose top line stays bright and live."""

from collections.abc import Mapping
from typing import Final

from textual.app import ComposeResult
from textual.containers import Horizontal, VerticalScroll
from textual.screen import ModalScreen
from textual.widgets import Input, Label

from tui.app.actions import Action, bindings

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


class FormScreen(ModalScreen[dict[str, str] | None]):
    """Answers what stands in each line, by its name, once one is sent off with Enter; None where it was closed.

    `titles` and `texts` are by name.
    """

    BINDINGS = bindings(FILLING)  # type: ignore[assignment]

    def __init__(self, title: str, titles: Mapping[str, str], texts: Mapping[str, str]) -> None:
        super().__init__()
        self._asked, self._titles, self._texts = title, titles, texts

    def compose(self) -> ComposeResult:
        with VerticalScroll(id="form-box", can_focus=False) as box:
            for name, title in self._titles.items():
                with Horizontal(classes="form-line"):
                    yield Label(title)
                    yield Input(self._texts.get(name, ""), "--", name=name, select_on_focus=False)
        box.border_title = self._asked
        box.border_subtitle = "enter keeps all, escape leaves it, arrows go on"

    def on_input_submitted(self) -> None:
        self.dismiss({str(line.name): line.value for line in self.query(Input)})
