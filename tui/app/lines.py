"""Lines of text with roles: what a widget shows, before it has any colour."""

from typing import Final, Literal, get_args

from rich.cells import cell_len

Role = Literal[
    "plain",  # words
    "quiet",  # labels, units, axes
    "strong",  # values
    "accent",  # the one colour: what was measured
    "reference",  # what was asked for
    "rule",  # lines that only divide
    "stale",  # old: dimmed, and dated beside it
    "faded",  # a curve or a bar of what is stale
    "warn",
    "bad",
    "lost",  # inverse: what must not be overlooked
    "armed",
    "failsafe",
    "tab",  # the screen that is shown
    "key",  # at the bottom, before what it does
]
ROLES: Final[tuple[Role, ...]] = get_args(Role)

Span = tuple[str, Role]
Line = tuple[Span, ...]
Lines = tuple[Line, ...]


def width(line: Line) -> int:
    """Cells of a line; every character that is used here is one cell wide."""
    return sum(len(text) for text, _ in line)


def harmless(text: str) -> str:
    """`text` as many cells wide as it has characters, with nothing in it that could steer a terminal."""
    if text.isascii() and text.isprintable():
        return text
    return "".join(c if c.isprintable() and cell_len(c) == 1 else "?" for c in text)


def changed(before: Line, after: Line) -> tuple[int, int]:
    """From which cell to which (excluded) two lines differ; of a shorter one the rest is blank."""
    cells = max(width(before), width(after))
    old, new = _cells(before, cells), _cells(after, cells)
    differing = [n for n in range(cells) if old[n] != new[n]]
    return (differing[0], differing[-1] + 1) if differing else (0, 0)


def _cells(line: Line, count: int) -> list[Span]:
    """Each cell by itself."""
    cells: list[Span] = [(character, role) for text, role in line for character in text]
    return cells + [(" ", "plain")] * (count - len(cells))


def cut(text: str, cells: int) -> str:
    """`text` in no more than `cells`, with an ellipsis where something is missing."""
    return text if len(text) <= cells else f"{text[: max(cells - 1, 0)]}…"[:cells]


def apart(left: Line, right: Line, cells: int) -> Line:
    """`left` and `right` at the two ends of `cells`; `right` is left out where there is no room for it."""
    room = cells - width(left) - width(right)
    return (*left, (" " * room, "plain"), *right) if room >= 1 else left


def heading(title: str, note: str, cells: int) -> Line:
    """The line above a pane: its title, a rule, and a note at the right, such as a key."""
    rule = cells - len(title) - len(note) - (2 if note else 1)
    if rule < 1:
        return ((cut(title, cells), "quiet"),)
    line: Line = ((f"{title} ", "quiet"), ("─" * rule, "rule"))
    return (*line, (f" {note}", "quiet")) if note else line
