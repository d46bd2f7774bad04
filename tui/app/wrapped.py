"""Sentences wrapped to a width, and bars."""

import textwrap
from typing import Final

from tui.app.lines import Lines, Role

EIGHTHS: Final = " ▏▎▍▌▋▊▉█"


def wrapped(text: str, role: Role, cells: int, indent: str = "", further: str = "") -> Lines:
    """Wrap a sentence into as many lines as it needs; `further` indents those after the first."""
    room = max(cells - len(indent), 10)
    pieces = textwrap.wrap(text, room, subsequent_indent=further) or [""]
    return tuple(((indent + piece, role),) for piece in pieces)


def hanging(text: str, role: Role, cells: int) -> Lines:
    """Wrap one of several stacked sentences: its later lines are indented, so that the next sentence stands out."""
    return wrapped(text, role, cells - 1, further="  ")


def bar(share: float, cells: int) -> str:
    """A bar from the left, in eighths of a cell."""
    eighths = max(0, min(round(share * 8 * cells), 8 * cells))
    full, part = divmod(eighths, 8)
    return ("█" * full + (EIGHTHS[part] if part else "")).ljust(cells)
