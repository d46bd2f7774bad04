"""Lines of text with roles, before they have any colour; and numbers in an operator's terms."""

import math
import textwrap
from collections.abc import Callable, Iterable, Sequence
from datetime import UTC, datetime
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

EIGHTHS: Final = " ▏▎▍▌▋▊▉█"
NOTHING: Final = "--"
SAME: Final = 5e-4
"""Relative difference up to which a value is the same to a reader: +0.0 %."""
_DEGREES: Final = 180.0 / math.pi
SHOWN_IN: Final = {"rad/s": ("deg/s", _DEGREES), "rad": ("deg", _DEGREES)}
"""Units of files and lines, and the units that people read, with the factor between them."""


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
    """The single cells of a line, padded with blanks to `count`."""
    cells: list[Span] = [(character, role) for text, role in line for character in text]
    return cells + [(" ", "plain")] * (count - len(cells))


def cut(text: str, cells: int) -> str:
    """`text` in at most `cells`, with an ellipsis if it was cut."""
    return text if len(text) <= cells else f"{text[: max(cells - 1, 0)]}…"[:cells]


def apart(left: Line, right: Line, cells: int) -> Line:
    """`left` and `right` at the two ends of `cells`; `right` is left out if it does not fit."""
    room = cells - width(left) - width(right)
    return (*left, (" " * room, "plain"), *right) if room >= 1 else left


def abreast(parts: Sequence[Line], each: int) -> Line:
    """Lines beside each other, each but the last as wide as `each` cells."""
    *before, last = parts
    return (*(span for part in before for span in (*part, (" " * (each - width(part)), "plain"))), *last)


def heading(title: str, note: str, cells: int) -> Line:
    """The line above a pane: its title, a rule, and a note at the right, such as a key; the title is cut to fit."""
    title = cut(title, max(cells - len(note) - 3, 0) if note else cells)
    rule = cells - len(title) - len(note) - (2 if note else 1)
    if rule < 1:
        return ((cut(title or note, cells), "quiet"),)
    line: Line = ((f"{title} ", "quiet"), ("─" * rule, "rule"))
    return (*line, (f" {note}", "quiet")) if note else line


def titled(title: str, note: str, cells: int) -> Lines:
    """`heading`; where both have no room, the whole title comes first, and the note below it."""
    if width(((title, "quiet"), (note, "quiet"))) + 3 <= cells:
        return (heading(title, note, cells),)
    return (*wrapped(title, "quiet", cells), heading(note, "", cells))


def wrapped(text: str, role: Role, cells: int, indent: str = "", further: str = "") -> Lines:
    """Wrap a sentence into as many lines as it needs; `further` indents those after the first."""
    room = max(cells - len(indent), 10)
    pieces = textwrap.wrap(text, room, subsequent_indent=further) or [""]
    return tuple(((indent + piece, role),) for piece in pieces)


def hanging(text: str, role: Role, cells: int) -> Lines:
    """Wrap one of several stacked sentences: its later lines are indented, so that the next sentence stands out."""
    return wrapped(text, role, cells - 1, further="  ")


def stacked(
    sentences: Iterable[str], role: Role, cells: int, wrap: Callable[[str, Role, int], Lines] = wrapped
) -> Lines:
    """Sentences below each other, those that are empty left out."""
    return tuple(line for sentence in sentences if sentence for line in wrap(sentence, role, cells))


def with_head(head: Line, text: str, role: Role, cells: int) -> Lines:
    """A head and, at its right, a sentence on as many rows as it needs."""
    first, *more = wrapped(text, role, max(cells - width(head), 1))
    blank: Span = (" " * width(head), "plain")
    return ((*head, *first), *((blank, *line) for line in more))


def window(count: int, at: int, rows: int) -> tuple[int, int]:
    """First of the entries shown in `rows` rows below a heading, with that at `at` in the middle if possible, and how
    many fit: if some are left out, a row is kept for the note about them.
    """
    room = max(rows - 1, 1)
    if count > room:
        room = max(room - 1, 1)
    return max(0, min(at - room // 2, count - room)), room


def entry_at(y: int, count: int, at: int, rows: int) -> int | None:
    """Index of the entry in line `y` of a table; None for its heading and below its last entry."""
    first, room = window(count, at, rows)
    entry = first + y - 1
    return entry if 1 <= y <= room and entry < count else None


def around(count: int, at: int, rows: int, row: Callable[[int], Line]) -> Lines:
    """The lines of a table below its heading: the rows of the entries shown, and how many are left out on each side."""
    first, room = window(count, at, rows)
    shown = range(first, min(first + room, count))
    left_out = [(first, "above"), (count - first - len(shown), "below")]
    hidden = [f"{lines_of(number)} {side}" for number, side in left_out if number]
    note: Lines = (((f"   … {', '.join(hidden)}", "warn"),),) if hidden else ()
    return (*map(row, shown), *note)


def lines_of(count: int) -> str:
    """`1 line`, `7 lines`."""
    return f"{count} line{'' if count == 1 else 's'}"


def bar(share: float, cells: int) -> str:
    """A bar from the left, in eighths of a cell."""
    eighths = max(0, min(round(share * 8 * cells), 8 * cells))
    full, part = divmod(eighths, 8)
    return ("█" * full + (EIGHTHS[part] if part else "")).ljust(cells)


def number(value: float, digits: int) -> str:
    """`value` with `digits` decimals; NOTHING if it is not finite."""
    if not math.isfinite(value):
        return NOTHING
    text = f"{value:.{digits}f}"
    return text if float(text) else text.lstrip("-")


def age(seconds: float) -> str:
    """Format an age: `0.4 s`, `12 s`, `7 min`, `3 h`; `not yet` for infinity."""
    if not math.isfinite(seconds):
        return "not yet"
    if seconds < 9.95:
        return f"{max(seconds, 0.0):.1f} s"
    if seconds < 120:
        return f"{seconds:.0f} s"
    return f"{seconds / 60:.0f} min" if seconds < 7200 else f"{seconds / 3600:.0f} h"


def ago(seconds: float) -> str:
    """`12 s ago`, or `not yet`."""
    return f"{age(seconds)} ago" if math.isfinite(seconds) else "not yet"


def stopwatch(seconds: float) -> str:
    """`00:12:31`."""
    whole_s = max(0, int(seconds))
    return f"{whole_s // 3600:02d}:{whole_s // 60 % 60:02d}:{whole_s % 60:02d}"


def left(seconds: float) -> str:
    """Format the remaining time: `41 h left`, `38 min left`."""
    return f"{seconds / 3600:.0f} h left" if seconds >= 7200 else f"{max(seconds, 0.0) / 60:.0f} min left"


def day(unix_s: float) -> str:
    """Date and time of day, `2026-11-21 09:12`; dashes if unknown."""
    return f"{datetime.fromtimestamp(unix_s, UTC):%Y-%m-%d %H:%M}" if math.isfinite(unix_s) else NOTHING


def utc(unix_s: float) -> str:
    """Time of day, `09:12:31`; dashes if unknown."""
    return f"{datetime.fromtimestamp(unix_s, UTC):%H:%M:%S}" if math.isfinite(unix_s) else "--:--:--"
