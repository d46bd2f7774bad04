"""What the app keeps of its user: the theme, in `~/.local/state/seatrial/tui.json`."""

import contextlib
import json
import os
from pathlib import Path

from bridge.file_size import read_small
from bridge.new_file import whole
from bridge.plain import from_json
from tui.app import themes


def state_file() -> Path:
    """Where it is kept; the XDG base directory specification names the folder."""
    home = os.environ.get("XDG_STATE_HOME") or Path.home() / ".local" / "state"
    return Path(home) / "seatrial" / "tui.json"


def load_theme() -> str:
    """The theme of last time; `dark` where there is none."""
    try:
        kept = from_json(read_small(state_file()))
    except (OSError, ValueError):
        return themes.ORDER[0]
    name = kept.get("theme") if isinstance(kept, dict) else None
    return name if name in themes.ORDER else themes.ORDER[0]


def keep_theme(name: str) -> None:
    """Keep it for next time; a disk that takes nothing is no reason to stop."""
    file = state_file()
    with contextlib.suppress(OSError):
        file.parent.mkdir(parents=True, exist_ok=True)
        with whole(file) as made:
            made.write((json.dumps({"theme": name}) + "\n").encode())
