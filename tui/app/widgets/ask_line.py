"""A question below a screen, with a line for the answer; keys pressed before the line is drawn are typed as well."""

from collections.abc import Callable

from textual import events
from textual.app import ComposeResult
from textual.containers import Vertical
from textual.widgets import Input

from tui.app.lines import Lines
from tui.app.widgets.drawn import Drawn


class AskLine(Vertical):
    """`question(cells, rows)` makes its words. Enter sends the typed text as `Input.Submitted`."""

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
        self.call_after_refresh(self._line.focus)

    def close(self) -> None:
        """Hide the line and forget its text."""
        self.is_open = False
        self.remove_class("-open")
        self.empty()
        self._line.disabled = True
        self.screen.set_focus(None)

    def empty(self) -> None:
        """Clear the line for another try."""
        self._line.value = ""

    async def take(self, event: events.Key) -> bool:
        """Type a key that was pressed before the line was drawn; False for a key that it does not use."""
        if not self.is_open:
            return False
        if event.key == "enter":
            await self._line.action_submit()
        elif event.key == "backspace":
            self._line.action_delete_left()
        elif event.is_printable and event.character is not None:
            self._line.insert_text_at_cursor(event.character)
        else:
            return False
        return True
