"""Preferences of the user: the theme, in `~/.local/state/seatrial/tui.json`."""

import contextlib
import json
import os
from pathlib import Path

from bridge.file_size import read_small
from bridge.new_file import whole
from bridge.plain import from_json
from tui.app import themes


def state_file() -> Path:
    """Path of the file; the folder follows the XDG base directory specification."""
    home = os.environ.get("XDG_STATE_HOME") or Path.home() / ".local" / "state"
    return Path(home) / "seatrial" / "tui.json"


def load_theme() -> str:
    """The theme of the last session; `dark` if none is stored."""
    try:
        kept = from_json(read_small(state_file()))
    except (OSError, ValueError):
        return themes.ORDER[0]
    name = kept.get("theme") if isinstance(kept, dict) else None
    return name if name in themes.ORDER else themes.ORDER[0]


def keep_theme(name: str) -> None:
    """Save the theme for the next session; a disk error is ignored."""
    file = state_file()
    with contextlib.suppress(OSError):
        file.parent.mkdir(parents=True, exist_ok=True)
        with whole(file) as made:
            made.write((json.dumps({"theme": name}) + "\n").encode())
