"""The table of actions, from which keys, help and palette are made; the user's keymap over it; and the view-only gate.

The keymap is `~/.config/seatrial/keymap.yaml` or another file. Of the app's own actions, a view-only app runs only
those that the table marks as looking: a new action is refused there until somebody has considered it.
"""

import difflib
import unicodedata
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from enum import Flag, auto
from pathlib import Path
from typing import Final

from textual.actions import parse
from textual.binding import Binding
from textual.keys import KEY_NAME_REPLACEMENTS, Keys

from bridge import exit_codes
from bridge.errors import ConfigError
from bridge.files import settings_folder
from bridge.reports import Report
from bridge.schema import load_yaml
from tui.app.jobs import Done, work

MODIFIERS: Final = frozenset({"ctrl", "shift", "alt", "super", "hyper", "meta"})
NAMED_KEYS: Final = frozenset(
    (*(key.value.rpartition("+")[2] for key in Keys), *KEY_NAME_REPLACEMENTS.values())
)
Keymap = dict[str, str]
OURS: Final = "tui."
UNLISTED: Final = frozenset({"use_theme"})
"""Actions that only the palette calls, and that only change the look of this screen."""
LOOKING_VERBS: Final = frozenset({"dives"})
"""Verbs that only list. The file that `dives` keeps next to a dive merely saves reading the dive again."""


class Mark(Flag):
    """Of an action: not in the footer; live even while the user types, and above any overlay; only looking.

    An action that only looks changes the display of this screen and nothing else, so a view-only app allows it.
    """

    HIDDEN = auto()
    ALWAYS = auto()
    LOOKS = auto()


SHOWN, HIDDEN, ALWAYS, LOOKS = Mark(0), Mark.HIDDEN, Mark.ALWAYS, Mark.LOOKS


@dataclass(frozen=True)
class Action:
    """An action that a key triggers. `keys` are Textual's names, separated by commas.

    `words` appear in the footer, `sentence` in help and palette. `mark` says more of it. `call` is its action string,
    by default the last word of its id.
    """

    id: str
    keys: str
    words: str
    sentence: str
    mark: Mark = SHOWN
    call: str = ""

    def __post_init__(self) -> None:
        if not self.call:
            object.__setattr__(self, "call", self.id.rpartition(".")[2])

    @property
    def looks(self) -> bool:
        return Mark.LOOKS in self.mark

    @property
    def always(self) -> bool:
        return Mark.ALWAYS in self.mark

    @property
    def binding(self) -> Binding:
        return Binding(
            self.keys,
            self.call,
            self.words,
            show=Mark.HIDDEN not in self.mark,
            priority=self.always,
            tooltip=self.sentence,
            id=self.id,
        )


OF_APP: Final = (
    # ctrl+x is one byte: no ssh, tmux, screen, serial console or browser intercepts it, and a slow link can't split it.
    # F12 needs a single finger, but is an escape sequence, and some terminals and browsers intercept it.
    (
        "ff.off",
        "ctrl+x,f12",
        "FF off",
        "feed-forward off, sent until it is acknowledged",
        ALWAYS,
        "force_off",
    ),
    ("app.help", "question_mark,f1", "Help", "the keys that work here, and the marks", LOOKS, "help"),
    ("app.palette", "ctrl+p", "Palette", "find an action by its name", ALWAYS | LOOKS, "command_palette"),
    ("link.connect", "ctrl+l", "Connect", "a serial port, an address, a recording", HIDDEN, "connect"),
    ("vehicle.name", "ctrl+k", "Vehicle", "the vehicle file of dives that name none", HIDDEN, "name_vehicle"),
    ("recording.begin", "ctrl+g", "Record", "begin a recording, where none runs any more", HIDDEN, "record"),
    (
        "recording.decline",
        "ctrl+d",
        "Don't record",
        "end the recording just begun, and only look",
        HIDDEN,
        "decline",
    ),
    ("recording.next", "ctrl+n", "Next dive", "go on recording in a new dive folder", HIDDEN, "next_dive"),
    (
        "recording.end",
        "ctrl+e",
        "End recording",
        "record no longer; asks for a word first",
        HIDDEN,
        "end_recording",
    ),
    ("ff.raise", "ctrl+u", "Raise FF", "shadow, then both after a GO; asks for words", HIDDEN, "raise_ff"),
    (
        "flight.end",
        "ctrl+f",
        "End flight",
        "the flight Fly began: it holds; again: disarms",
        HIDDEN | ALWAYS,
        "end_flight",
    ),
    ("ff.lower", "ctrl+y", "Lower FF", "to shadow, where it only computes; does not ask", HIDDEN, "lower_ff"),
    ("theme.next", "t", "Theme", "dark, light, sunlight", LOOKS, "next_theme"),
    ("app.quit", "ctrl+q", "Quit", "leave; the recording goes on", ALWAYS | LOOKS, "quit"),
    ("app.close", "escape", "Close", "close what lies over the screen", HIDDEN | LOOKS, "close"),
)
EVERYWHERE: Final = tuple(
    Action(name, keys, words, sentence, mark, f"app.{call}")
    for name, keys, words, sentence, mark, call in OF_APP
)


def bindings(actions: Iterable[Action]) -> list[Binding]:
    return [action.binding for action in actions]


Places = Sequence[Sequence[Action]]
"""Groups of actions that may be live at the same time, each including those that are live everywhere."""


def user_file() -> Path:
    """Path of the user's own keymap, which may not exist."""
    return settings_folder() / "keymap.yaml"


def load_keymap(file: Path | None, places: Places) -> Keymap:
    """Load the keys of `file` by action id; for None, those of the user's own file if it exists.

    Raises ConfigError for an unknown action, an unknown key, or a key that two actions share.
    """
    if file is None:
        file = user_file()
        if not file.exists():
            return {}
    given = load_yaml(file)
    if given is None:
        return {}
    if not isinstance(given, dict):
        raise ConfigError(f"{file}: a keymap is lines such as 'ff.off: \"ctrl+x\"'; it is none")
    actions = {action.id: action for place in places for action in place}
    keymap = {}
    for name, keys in given.items():
        if name not in actions:
            raise ConfigError(f"{file}: unknown action '{name}'; {_nearest(str(name), actions)}")
        keymap[str(name)] = _checked(keys, str(name), file)
    _check_clashes(keymap, places, file)
    return keymap


def _nearest(name: str, actions: dict[str, Action]) -> str:
    near = difflib.get_close_matches(name, actions, n=1)
    return f"did you mean '{near[0]}'?" if near else f"the actions are {', '.join(actions)}"


def _checked(keys: object, name: str, file: Path) -> str:
    if isinstance(keys, bool) or not isinstance(keys, str | int) or not str(keys).strip():
        raise ConfigError(
            f'{file}: {name}: give its keys in quotes, such as "f5" or "ctrl+o,o", not \'{keys}\''
        )
    split = [key.strip() for key in str(keys).split(",")]
    for key in split:
        if not _is_key(key):
            raise ConfigError(
                f'{file}: {name}: \'{key}\' is no key; give one such as "c", "f5", "ctrl+o" or "pagedown"'
            )
    return ",".join(split)


def _is_key(key: str) -> bool:
    *modifiers, last = key.split("+")
    if not MODIFIERS.issuperset(modifiers) or not last:
        return False
    if len(last) == 1 or last in NAMED_KEYS:
        return True
    try:
        unicodedata.lookup(last.replace("_", " "))
    except KeyError:
        return False
    return True


def _check_clashes(keymap: Keymap, places: Places, file: Path) -> None:
    for place in places:
        holder: dict[str, str] = {}
        for action in place:
            for key in _normal(keymap.get(action.id, action.keys)):
                owner = holder.setdefault(key, action.id)
                if owner != action.id:
                    raise ConfigError(
                        f"{file}: the key '{key}' belongs to both {owner} and {action.id}; give one of them another"
                    )


def _normal(keys: str) -> list[str]:
    """Each key by its long name, so that `?` is `question_mark`."""
    return [binding.key for binding in Binding.make_bindings([Binding(keys, "")])]


class Gate:
    """Decides which actions may run; made from the actions of all screens."""

    def __init__(self, actions: Iterable[Action]) -> None:
        self._looking = UNLISTED | {name_of(action) for action in actions if action.looks}

    def refuses(self, target: object, name: str) -> bool:
        """Whether `target`'s action of that name must not run. Textual's own actions, such as scrolling, may."""
        method = getattr(target, f"_action_{name}", None) or getattr(target, f"action_{name}", None)
        return getattr(method, "__module__", "").startswith(OURS) and name not in self._looking


async def looking_work(
    words: Sequence[str], hear: Callable[[Report], None], pressed: Callable[[], int]
) -> Done:
    """`tui.app.jobs.work` for a view-only app: only verbs that look may run."""
    if words[0] in LOOKING_VERBS:
        return await work(words, hear, pressed)
    return Done(exit_codes.NO, None, (f"VIEW ONLY: seatrial {words[0]} is not run from here",))


def name_of(action: Action) -> str:
    """Name of the method that an action calls, without `action_`."""
    return parse(action.call)[1]
