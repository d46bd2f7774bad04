"""What the app keeps of its user: the theme, in `~/.local/state/seatrial/tui.json`."""

import contextlib
import json
import os
from pathlib import Path

from bridge.plain import from_json
from tui.app import themes


def state_file() -> Path:
    """Where it is kept; the XDG base directory specification names the folder."""
    home = os.environ.get("XDG_STATE_HOME") or Path.home() / ".local" / "state"
    return Path(home) / "seatrial" / "tui.json"


def load_theme() -> str:
    """The theme of last time; `dark` where there is none."""
    try:
        kept = from_json(state_file().read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return themes.ORDER[0]
    name = kept.get("theme") if isinstance(kept, dict) else None
    return name if name in themes.ORDER else themes.ORDER[0]


def keep_theme(name: str) -> None:
    """Keep it for next time; a disk that takes nothing is no reason to stop."""
    file = state_file()
    partial = file.with_suffix(".part")
    with contextlib.suppress(OSError):
        file.parent.mkdir(parents=True, exist_ok=True)
        partial.write_text(json.dumps({"theme": name}) + "\n", encoding="utf-8")
        partial.replace(file)
