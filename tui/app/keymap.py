"""Keys by action id: `~/.config/seatrial/keymap.yaml` or another file, over the defaults of `actions`."""

import difflib
import os
import unicodedata
from collections.abc import Sequence
from pathlib import Path
from typing import Final

from textual.keys import KEY_NAME_REPLACEMENTS, Keys

from bridge.errors import ConfigError
from bridge.schema import load_yaml
from tui.app.actions import Action

MODIFIERS: Final = frozenset({"ctrl", "shift", "alt", "super", "hyper", "meta"})
NAMED_KEYS: Final = frozenset(
    (*(key.value.rpartition("+")[2] for key in Keys), *KEY_NAME_REPLACEMENTS.values())
)
Keymap = dict[str, str]
Places = Sequence[Sequence[Action]]
"""Groups of actions that may be live at the same time, each including those that are live everywhere."""


def own_file() -> Path:
    """Path of the user's own keymap, which may not exist; the folder follows the XDG base directory specification."""
    home = os.environ.get("XDG_CONFIG_HOME") or Path.home() / ".config"
    return Path(home) / "seatrial" / "keymap.yaml"


def load_keymap(file: Path | None, places: Places) -> Keymap:
    """Load the keys of `file` by action id; for None, those of the user's own file if it exists.

    Raises ConfigError for an unknown action, an unknown key, or a key that two actions share.
    """
    if file is None:
        file = own_file()
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
    return [_long_name(key) for key in keys.split(",")]


def _long_name(key: str) -> str:
    if len(key) > 1 or key.isalnum():
        return key
    name = unicodedata.name(key).lower().replace("-", "_").replace(" ", "_")
    return KEY_NAME_REPLACEMENTS.get(name, name)
