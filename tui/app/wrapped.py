"""Sentences in lines of a width, and bars."""

import textwrap
from typing import Final

from tui.app.lines import Lines, Role

EIGHTHS: Final = " ▏▎▍▌▋▊▉█"


def wrapped(text: str, role: Role, cells: int, indent: str = "") -> Lines:
    """A sentence in as many lines as it needs."""
    room = max(cells - len(indent), 10)
    return tuple(((indent + piece, role),) for piece in textwrap.wrap(text, room) or [""])


def bar(share: float, cells: int) -> str:
    """A bar from the left, in eighths of a cell."""
    eighths = max(0, min(round(share * 8 * cells), 8 * cells))
    full, rest = divmod(eighths, 8)
    return ("█" * full + (EIGHTHS[rest] if rest else "")).ljust(cells)
