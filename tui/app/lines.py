"""Lines of text with roles: the content of a widget, before it has any colour."""

from typing import Final, Literal, get_args

from rich.cells import cell_len

Role = Literal[
    "plain",  # words
    "quiet",  # labels, units, axes
    "strong",  # values
    "accent",  # the single colour: measured values
    "reference",  # desired values
    "rule",  # dividing lines
    "stale",  # old: dimmed, with its age next to it
    "faded",  # a stale curve or bar
    "warn",
    "bad",
    "lost",  # inverse: must not be overlooked
    "armed",
    "failsafe",
    "tab",  # the current screen
    "key",  # at the bottom, before its description
]
ROLES: Final[tuple[Role, ...]] = get_args(Role)

Span = tuple[str, Role]
Line = tuple[Span, ...]
Lines = tuple[Line, ...]


def width(line: Line) -> int:
    """Cells of a line; every character used here is one cell wide."""
    return sum(len(text) for text, _ in line)


def harmless(text: str) -> str:
    """Replace characters that are not one cell wide or could control a terminal by `?`."""
    if text.isascii() and text.isprintable():
        return text
    return "".join(c if c.isprintable() and cell_len(c) == 1 else "?" for c in text)


def changed(before: Line, after: Line) -> tuple[int, int]:
    """First cell and end (exclusive) of the range in which two lines differ; a shorter line is padded with blanks."""
    cells = max(width(before), width(after))
    old, new = _cells(before, cells), _cells(after, cells)
    differing = [n for n in range(cells) if old[n] != new[n]]
    return (differing[0], differing[-1] + 1) if differing else (0, 0)


def _cells(line: Line, count: int) -> list[Span]:
    """The cells of a line one by one, padded with blanks to `count`."""
    cells: list[Span] = [(character, role) for text, role in line for character in text]
    return cells + [(" ", "plain")] * (count - len(cells))


def cut(text: str, cells: int) -> str:
    """`text` in at most `cells`, with an ellipsis if it was cut."""
    return text if len(text) <= cells else f"{text[: max(cells - 1, 0)]}…"[:cells]


def apart(left: Line, right: Line, cells: int) -> Line:
    """`left` and `right` at the two ends of `cells`; `right` is left out if it does not fit."""
    room = cells - width(left) - width(right)
    return (*left, (" " * room, "plain"), *right) if room >= 1 else left


def heading(title: str, note: str, cells: int) -> Line:
    """The line above a pane: its title, a rule, and a note at the right, such as a key."""
    rule = cells - len(title) - len(note) - (2 if note else 1)
    if rule < 1:
        return ((cut(title, cells), "quiet"),)
    line: Line = ((f"{title} ", "quiet"), ("─" * rule, "rule"))
    return (*line, (f" {note}", "quiet")) if note else line
