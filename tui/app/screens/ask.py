"""A line to type into, over a screen whose top line stays bright and live."""

from typing import Final

from textual.app import ComposeResult
from textual.containers import Vertical
from textual.widgets import Input

from tui.app.actions import Action, bindings
from tui.app.screens.over import OverScreen

ASKING: Final = (
    Action(
        "ask.cancel",
        "escape",
        "dismiss(None)",
        "Cancel",
        "back, and nothing is changed",
        in_footer=False,
        looks=True,
    ),
)


class AskScreen(OverScreen[str | None]):
    """Returns the text typed when Enter sends it; None if it was closed."""

    BINDINGS = bindings(ASKING)  # type: ignore[assignment]

    def __init__(self, title: str, value: str = "", hint: str = "", does: str = "keeps") -> None:
        super().__init__()
        self._asked, self._value, self._hint, self._does = title, value, hint, does

    def compose(self) -> ComposeResult:
        box = Vertical(
            Input(self._value, placeholder=self._hint, select_on_focus=False), id="ask-box", classes="box"
        )
        box.border_title = self._asked
        box.border_subtitle = f"enter {self._does}, escape leaves it"
        yield box

    def on_input_submitted(self, event: Input.Submitted) -> None:
        self.dismiss(event.value)
