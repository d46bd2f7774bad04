"""The live keys at the bottom; the help key shows how many do not fit, and the help lists them all."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

from textual import events

from tui.app.lines import Line, Lines
from tui.app.widgets.drawn import Drawn

ALWAYS = ("app.force_off", "app.help")
"""Actions that must be visible on any terminal."""
HELP = "app.help"


@dataclass(frozen=True)
class LiveKey:
    """A key that has an effect now: its name in Textual, its display form, its words, and the action."""

    name: str
    written: str
    words: str
    action: str

    @property
    def spans(self) -> Line:
        return ((f" {self.written} ", "key"), (f"{self.words} ", "quiet"))

    @property
    def cells(self) -> int:
        return sum(len(text) for text, _ in self.spans)


def fitting(keys: Sequence[LiveKey], cells: int) -> tuple[LiveKey, ...]:
    """Drop keys from the end until the rest fits into `cells`; those in `ALWAYS` are never dropped."""
    last_first = [key for key in reversed(keys) if key.action not in ALWAYS]
    for count in range(len(last_first) + 1):
        shown = tuple(_telling(key, count) for key in keys if key not in last_first[:count])
        if sum(key.cells for key in shown) <= cells:
            break
    return shown


def _telling(key: LiveKey, left_out: int) -> LiveKey:
    """The key, or for the help key a version that shows how many keys are left out."""
    return replace(key, words=f"{key.words}, {left_out} more") if left_out and key.action == HELP else key


class KeyLine(Drawn):
    """All keys in a single widget: a widget per key, as in Textual's footer, makes changing screens slow."""

    ALLOW_SELECT = False

    def __init__(self) -> None:
        super().__init__(self._made)

    def on_mount(self) -> None:
        self.screen.bindings_updated_signal.subscribe(self, lambda _: self.again())

    def on_unmount(self) -> None:
        self.screen.bindings_updated_signal.unsubscribe(self)

    def on_click(self, event: events.Click) -> None:
        """A click on a key presses it."""
        end = 0
        for key in fitting(tuple(self._live()), self.size.width):
            end += key.cells
            if event.x < end:
                self.app.simulate_key(key.name)
                return

    def _made(self, cells: int, rows: int) -> Lines:
        del rows
        return (tuple(span for key in fitting(tuple(self._live()), cells) for span in key.spans),)

    def _live(self) -> Iterator[LiveKey]:
        """The keys of the footer, the first key of each action."""
        seen = set()
        for _, binding, enabled, _ in self.screen.active_bindings.values():
            if binding.show and enabled and binding.action not in seen:
                seen.add(binding.action)
                yield LiveKey(
                    binding.key, self.app.get_key_display(binding), binding.description, binding.action
                )
