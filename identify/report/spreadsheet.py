"""A table of a page as CSV: a number a cell and its unit in the head, where the page has words for people.

"4.9 mm/s → 2.3 mm/s" becomes two columns, "0.7915 (0.7848 to 0.7982)" three. A cell without a quantity stays as it is.
"""

import csv
import io
import re
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

from identify.words import MISSING

NUMBER: Final = (
    r"[+\-\u2212]?\d{1,3}(?:[ \u00a0\u2009\u202f]\d{3})+(?:\.\d+)?|[+\-\u2212]?\d+(?:\.\d+)?(?:e[+\-]?\d+)?"
)
QUANTITY: Final = re.compile(rf"(?P<number>{NUMBER})(?:[ \u00a0](?!to |-> )(?P<unit>[^\d\s→±(),]+(?: m)?))?")
BETWEEN: Final = re.compile(r" (→|->|to|±) | (\()|(\))$")
PARTS: Final[dict[tuple[str, ...], tuple[str, ...]]] = {
    (): ("",),
    ("→",): ("before", "after"),
    ("to",): ("from", "to"),
    ("±",): ("", "±"),
    ("(", "to", ")"): ("", "from", "to"),
}
"""The parts of a cell by the words between its quantities."""


@dataclass(frozen=True)
class _Cell:
    """Numbers and units of a cell, and the words between them."""

    numbers: tuple[str, ...]
    units: tuple[str, ...]
    between: tuple[str, ...]


def to_csv(columns: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """The table as CSV; the first column names the rows."""
    made: list[tuple[str, ...]] = [(columns[0], *(row[0] for row in rows))]
    for at in range(1, len(columns)):
        made += _column(columns[at], [row[at] for row in rows])
    text = io.StringIO()
    csv.writer(text, lineterminator="\n").writerows(zip(*made, strict=True))
    return text.getvalue()


def _column(head: str, cells: Sequence[str]) -> list[tuple[str, ...]]:
    """The columns that one of a page becomes, each with its head."""
    known = [None if cell in (MISSING, "") else _read(cell) for cell in cells]
    quantities = [cell for cell in known if cell is not None]
    filled = sum(cell not in (MISSING, "") for cell in cells)
    between = {cell.between for cell in quantities}
    if not quantities or len(quantities) < filled or len(between) > 1:
        return [(head, *("" if cell == MISSING else cell for cell in cells))]
    parts = PARTS[between.pop()]
    # A unit that stands once, as in "13.1 to 19.5 kg", is that of all numbers of the cell.
    units = [None if cell is None else _unit(cell) for cell in known]
    if any(unit is None for unit, cell in zip(units, known, strict=True) if cell is not None):
        return [(head, *("" if cell == MISSING else cell for cell in cells))]
    alike = {unit for unit in units if unit is not None}
    unit = alike.pop() if len(alike) == 1 else ""
    made = [
        (
            ", ".join(filter(None, (head, part, unit))),
            *("" if cell is None else cell.numbers[n] for cell in known),
        )
        for n, part in enumerate(parts)
    ]
    return [*made, (f"{head}, unit", *(unit or "" for unit in units))] if alike else made


def _read(cell: str) -> _Cell | None:
    """The quantities of a cell; None if it holds anything else."""
    numbers, units, between, at = [], [], [], 0
    while True:
        quantity = QUANTITY.match(cell, at)
        if quantity is None:
            return None
        numbers.append(_plain(quantity["number"]))
        units.append(quantity["unit"] or "")
        at = quantity.end()
        while at < len(cell):
            sign = BETWEEN.match(cell, at)
            if sign is None:
                return None
            between.append({"->": "→"}.get(word := next(filter(None, sign.groups())), word))
            at = sign.end()
            if word != ")":
                break
        if at >= len(cell):
            return _Cell(tuple(numbers), tuple(units), tuple(between)) if tuple(between) in PARTS else None


def _unit(cell: _Cell) -> str | None:
    """The unit of all numbers of a cell, "" for none; None if they have several."""
    units = set(filter(None, cell.units))
    return next(iter(units), "") if len(units) < 2 else None


def _plain(number: str) -> str:
    """A number as a spreadsheet reads it."""
    return re.sub(r"[ \u00a0\u2009\u202f]", "", number).replace("\u2212", "-").removeprefix("+")
