"""Looks of the roles in three themes and without colour, and the theme of the last session.

`sunlight` is black on white, for a screen in the sun: weight, underline and inverse raise a state, and its words and
marks say which it is.
"""

import contextlib
import json
from pathlib import Path
from typing import Final

from textual.theme import Theme

from bridge.files import write_whole
from gcs_plugin.recording.state import state_file
from tui.app.drawing import ROLES, Role
from tui.app.jobs import json_in

Look = tuple[str, str, str]
"""Foreground, background ("" for the screen's own), text style."""

ORDER: Final = ("dark", "light", "sunlight")

_INK, _PAPER = "#000000", "#ffffff"
LOOKS: Final[dict[Role, tuple[Look, Look, Look]]] = {
    "plain": (("#c3ccd4", "", "none"), ("#26303a", "", "none"), (_INK, "", "none")),
    "quiet": (("#8391a0", "", "none"), ("#5c6975", "", "none"), (_INK, "", "none")),
    "strong": (("#f2f5f7", "", "bold"), ("#000000", "", "bold"), (_INK, "", "bold")),
    "accent": (("#4fc3d9", "", "none"), ("#006a83", "", "none"), (_INK, "", "bold")),
    "reference": (("#e58fd0", "", "none"), ("#a0257f", "", "none"), (_INK, "", "none")),
    "rule": (("#3a4653", "", "none"), ("#c3cbd2", "", "none"), ("#8c8c8c", "", "none")),
    "stale": (("#66727f", "", "italic"), ("#8a959f", "", "italic"), (_INK, "", "underline")),
    "faded": (("#66727f", "", "none"), ("#8a959f", "", "none"), ("#8c8c8c", "", "none")),
    "warn": (("#e8b44f", "", "none"), ("#875400", "", "bold"), (_INK, "", "bold underline")),
    "bad": (("#ff6b73", "", "bold"), ("#b4001e", "", "bold"), (_PAPER, _INK, "bold")),
    "lost": (("#10151b", "#c3ccd4", "bold"), ("#ffffff", "#26303a", "bold"), (_PAPER, _INK, "bold")),
    "armed": (("#000000", "#ffb000", "bold"), ("#000000", "#ffb000", "bold"), (_PAPER, _INK, "bold")),
    "failsafe": (
        ("#ffffff", "#c81e2d", "bold"),
        ("#ffffff", "#c00020", "bold"),
        (_PAPER, _INK, "bold underline"),
    ),
    "tab": (("#4fc3d9", "", "bold underline"), ("#006a83", "", "bold underline"), (_PAPER, _INK, "bold")),
    "key": (("#4fc3d9", "", "bold"), ("#006a83", "", "bold"), (_INK, "", "bold")),
}
"""By role, the look in each theme of ORDER."""

WITHOUT_COLOUR: Final[dict[Role, str]] = {
    "rule": "dim",
    "stale": "dim",
    "faded": "dim",
    "warn": "bold underline",
    "bad": "bold reverse",
    "lost": "bold reverse",
    "armed": "bold reverse",
    "failsafe": "bold reverse underline",
    "tab": "bold underline",
    "key": "bold",
}
"""Text styles under NO_COLOR, when no colour is sent at all."""
_BACKGROUNDS: Final = {"dark": "#10151b", "light": "#f6f8f9", "sunlight": _PAPER}

ROLE_CLASSES: Final = frozenset(f"line--{role}" for role in ROLES)
"""Component classes, set on every screen with lines. On each widget they would cost a tenth of a second per key,
since Textual recomputes them all whenever a class of a screen changes.
"""


def looks_of(name: str) -> dict[Role, Look]:
    return {role: looks[ORDER.index(name)] for role, looks in LOOKS.items()}


def theme(name: str) -> Theme:
    looks, background = looks_of(name), _BACKGROUNDS[name]
    accent, plain, quiet = looks["accent"][0], looks["plain"][0], looks["quiet"][0]
    return Theme(
        name,
        primary=accent,
        secondary=quiet,
        accent=accent,
        warning=looks["warn"][0],
        error=looks["failsafe"][1],
        success=accent,
        foreground=plain,
        background=background,
        surface=background,
        panel=background,
        dark=name == "dark",
        variables={
            **_variables(looks, background),
            "block-cursor-foreground": looks["lost"][0],
            "block-cursor-background": looks["lost"][1],
            "block-cursor-blurred-foreground": looks["lost"][0],
            "block-cursor-blurred-background": looks["lost"][1],
            "border": looks["rule"][0],
            "scrollbar": quiet,
            "scrollbar-background": background,
            "scrollbar-hover": accent,
            "scrollbar-active": accent,
            "scrollbar-background-hover": background,
            "scrollbar-background-active": background,
        },
    )


def next_theme(name: str) -> str:
    return ORDER[(ORDER.index(name) + 1) % len(ORDER)] if name in ORDER else ORDER[0]


def _variables(looks: dict[Role, Look], background: str) -> dict[str, str]:
    variables: dict[str, str] = {}
    for role in ROLES:
        foreground, behind, style = looks[role]
        variables |= {f"{role}-fg": foreground, f"{role}-bg": behind or background, f"{role}-style": style}
    return variables


def variables(name: str) -> dict[str, str]:
    """The variables of `look.tcss` in a theme."""
    return _variables(looks_of(name), _BACKGROUNDS[name])


def component_css() -> str:
    roles = (
        f".line--{role} {{ color: ${role}-fg; background: ${role}-bg; text-style: ${role}-style; }}"
        for role in ROLES
    )
    bare = (
        f"Screen:nocolor > .line--{role} {{ text-style: {style}; }}" for role, style in WITHOUT_COLOUR.items()
    )
    return "\n".join((*roles, *bare))


def _theme_file() -> Path:
    return state_file().with_name("tui.json")


def load_theme() -> str:
    """The theme of the last session; `dark` if none is stored."""
    kept = json_in(_theme_file())
    name = kept.get("theme") if isinstance(kept, dict) else None
    return name if name in ORDER else ORDER[0]


def keep_theme(name: str) -> None:
    """Save the theme for the next session; a disk error is ignored."""
    file = _theme_file()
    with contextlib.suppress(OSError):
        file.parent.mkdir(parents=True, exist_ok=True)
        write_whole(file, json.dumps({"theme": name}) + "\n")
