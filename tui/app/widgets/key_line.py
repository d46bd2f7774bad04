"""The live keys at the bottom; those that have no room are counted beside the key of the help, which tells them all."""

from collections.abc import Sequence
from typing import Protocol, cast

from textual import events
from textual.app import ComposeResult
from textual.widget import Widget
from textual.widgets import Footer

ALWAYS = ("app.force_off", "app.help")
"""What these do must be seen on any terminal."""
AROUND = 3
"""Cells of a key beside its words."""


class Key(Protocol):
    """What Textual's footer is composed of, as far as it is known here."""

    action: str
    key_display: str
    description: str
    compact: bool
    _reactive_connect: object


class KeyLine(Footer):
    """Leaves out keys from the end until all fit, but never those of `ALWAYS`."""

    _cells = 0

    def compose(self) -> ComposeResult:
        self._cells = self.app.size.width
        keys = [cast(Key, key) for key in super().compose()]
        for key in keys:
            # Textual never lets go of a key that was bound to its line, and the line is made anew with each screen.
            key._reactive_connect, key.compact = None, self.compact
        shown, helps = list(keys), next((key for key in keys if key.action == "app.help"), None)
        words = helps.description if helps is not None else ""
        for key in reversed(keys):
            if _width(shown) <= self._cells:
                break
            if key.action not in ALWAYS:
                shown.remove(key)
            if helps is not None:
                helps.description = f"{words}, {len(keys) - len(shown)} more"
        yield from (cast(Widget, key) for key in shown)

    def on_resize(self, event: events.Resize) -> None:
        if event.size.width != self._cells:
            self.refresh(recompose=True)


def _width(keys: Sequence[Key]) -> int:
    return sum(len(key.key_display) + len(key.description) + AROUND for key in keys)
