"""Table of all actions: keys, help, palette and the keymap file are made from it."""

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Final

from textual.binding import Binding


@dataclass(frozen=True)
class Action:
    """An action that a key triggers. `keys` are Textual's names, separated by commas; `call` is its action string.

    `words` appear in the footer, `sentence` in help and palette. `always`: live even while the user types, and above
    any overlay. `looks`: it changes only the display of this screen, so a view-only app allows it; see `gate`.
    """

    id: str
    keys: str
    call: str
    words: str
    sentence: str
    in_footer: bool = True
    always: bool = False
    looks: bool = False

    @property
    def binding(self) -> Binding:
        return Binding(
            self.keys,
            self.call,
            self.words,
            show=self.in_footer,
            priority=self.always,
            tooltip=self.sentence,
            id=self.id,
        )


EVERYWHERE: Final = (
    # ctrl+x is one byte: no ssh, tmux, screen, serial console or browser intercepts it, and a slow link can't split it.
    # F12 needs a single finger, but is an escape sequence, and some terminals and browsers intercept it.
    Action(
        "ff.off",
        "ctrl+x,f12",
        "app.force_off",
        "FF off",
        "feed-forward off, sent until it is acknowledged",
        always=True,
    ),
    Action(
        "app.help",
        "question_mark,f1",
        "app.help",
        "Help",
        "the keys that work here, and the marks",
        looks=True,
    ),
    Action(
        "app.palette",
        "ctrl+p",
        "app.command_palette",
        "Palette",
        "find an action by its name",
        always=True,
        looks=True,
    ),
    Action(
        "recording.begin",
        "ctrl+g",
        "app.record",
        "Record",
        "begin a recording, where none runs any more",
        in_footer=False,
    ),
    Action(
        "recording.next",
        "ctrl+n",
        "app.next_dive",
        "Next dive",
        "go on recording in a new dive folder",
        in_footer=False,
    ),
    Action(
        "recording.end",
        "ctrl+e",
        "app.end_recording",
        "End recording",
        "record no longer; asks for a word first",
        in_footer=False,
    ),
    Action("theme.next", "t", "app.next_theme", "Theme", "dark, light, sunlight", looks=True),
    Action("app.quit", "ctrl+q", "app.quit", "Quit", "leave; the recording goes on", always=True, looks=True),
    Action(
        "app.close",
        "escape",
        "app.close",
        "Close",
        "close what lies over the screen",
        in_footer=False,
        looks=True,
    ),
)


def bindings(actions: Iterable[Action]) -> list[Binding]:
    """The Textual bindings of the actions."""
    return [action.binding for action in actions]
