"""The live keys at the bottom; those that have no room are counted beside the key of the help, which tells them all."""

from collections.abc import Sequence

from textual import events
from textual.app import ComposeResult
from textual.widgets import Footer
from textual.widgets._footer import FooterKey

ALWAYS = ("app.force_off", "app.help")
"""What these do must be seen on any terminal."""
AROUND = 3
"""Cells of a key beside its words."""


class KeyLine(Footer):
    """Leaves out keys from the end until all fit, but never those of `ALWAYS`."""

    _cells = 0

    def compose(self) -> ComposeResult:
        self._cells = self.app.size.width
        keys = [key for key in super().compose() if isinstance(key, FooterKey)]
        shown, helps = list(keys), next((key for key in keys if key.action == "app.help"), None)
        words = helps.description if helps is not None else ""
        for key in reversed(keys):
            if _width(shown) <= self._cells:
                break
            if key.action not in ALWAYS:
                shown.remove(key)
            if helps is not None:
                helps.description = f"{words}, {len(keys) - len(shown)} more"
        yield from shown

    def on_resize(self, event: events.Resize) -> None:
        if event.size.width != self._cells:
            self.refresh(recompose=True)


def _width(keys: Sequence[FooterKey]) -> int:
    return sum(len(key.key_display) + len(key.description) + AROUND for key in keys)
