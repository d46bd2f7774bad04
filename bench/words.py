"""Markdown of the page: paragraphs, tables, and the word for a goal."""

import math
import textwrap
from collections import Counter
from collections.abc import Iterable, Sequence

WIDTH = 118


def blocks(*parts: str) -> str:
    """The parts of a page with a blank line between them; an empty part is left out."""
    return "\n\n".join(part for part in parts if part)


def paragraph(*sentences: str) -> str:
    return textwrap.fill(" ".join(sentences), WIDTH, break_long_words=False, break_on_hyphens=False)


def table(head: Sequence[str], rows: Iterable[Iterable[object]]) -> str:
    return "\n".join([_row(head), "|---" * len(head) + "|", *map(_row, rows)])


def _row(cells: Iterable[object]) -> str:
    return "".join(f"| {cell} " if f"{cell}" else "| " for cell in cells) + "|"


def percent(share: float) -> str:
    """A share in per cent, to two digits or, from 100 on, to one per cent; a dash where there is none."""
    if not math.isfinite(share):
        return "-"
    return f"{100 * share:.0f}" if abs(share) >= 0.995 else f"{100 * share:.2g}"


def in_a_word(met: bool) -> str:
    return "met" if met else "**missed**"


def counted(names: Iterable[str], most: int | None = None, nothing: str = "-") -> str:
    """How often each name occurs, the most frequent first: `tether (3), waves (1)`."""
    return ", ".join(f"{name} ({count})" for name, count in Counter(names).most_common(most)) or nothing
