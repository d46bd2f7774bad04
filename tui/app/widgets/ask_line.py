"""A question below a screen, with a line to type the answer into; keys that come too early for it are typed as well."""

from collections.abc import Callable

from textual import events
from textual.app import ComposeResult
from textual.containers import Vertical
from textual.widgets import Input

from tui.app.lines import Lines
from tui.app.widgets.drawn import Drawn


class AskLine(Vertical):
    """`question(cells, rows)` makes its words. What is sent off with Enter comes as `Input.Submitted`."""

    def __init__(self, question: Callable[[int, int], Lines], *, id: str) -> None:
        super().__init__(id=id)
        self._question = question
        self._line = Input(select_on_focus=False, disabled=True)
        self.is_open = False

    def compose(self) -> ComposeResult:
        yield Drawn(self._question)
        yield self._line

    def open(self) -> None:
        """Show it, empty, and take what is typed from now on."""
        self.close()
        self.is_open = True
        self.add_class("-open")
        self._line.disabled = False
        # Only what is drawn can be typed into.
        self.call_after_refresh(self._line.focus)

    def close(self) -> None:
        """Hide it; what stood in it is forgotten."""
        self.is_open = False
        self.remove_class("-open")
        self.empty()
        self._line.disabled = True
        self.screen.set_focus(None)

    def empty(self) -> None:
        """Let it be typed anew."""
        self._line.value = ""

    async def take(self, event: events.Key) -> bool:
        """Type a key that was pressed before the line was drawn; False for one that it has no use for."""
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
