"""Cells of a table: words, or quantities with their unit, which the page and its CSV each write in their own way.

The page has a whole quantity in its cell. The CSV has a number a cell and the unit in the head, so that a change makes
two columns of a column, a value with its interval three.
"""

import csv
import io
import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from enum import Enum
from typing import Final

from identify import words
from identify.words import MISSING


class Form(Enum):
    """How the numbers of a quantity belong together: their pattern on the page, and the heads of their CSV columns."""

    SINGLE = ("{}", ("",))
    CHANGE = ("{} → {}", ("before", "after"))
    RANGE = ("{} to {}", ("from", "to"))
    SPREAD = ("{} ± {}", ("", "±"))
    INTERVAL = ("{} ({} to {})", ("", "from", "to"))

    def __init__(self, pattern: str, heads: tuple[str, ...]) -> None:
        self.pattern, self.heads = pattern, heads


class Style(Enum):
    """How a number is written on the page: as it is, with its sign, in groups of three, in minutes and hours."""

    PLAIN, SIGNED, GROUPED, DURATION = range(4)


@dataclass(frozen=True)
class Number:
    """A finite number and the decimals that its reader gets, negative for tens and hundreds."""

    value: float
    decimals: int
    style: Style = Style.PLAIN

    @property
    def plain(self) -> str:
        """As a spreadsheet reads it."""
        return f"{round(self.value, self.decimals) + 0.0:.{max(self.decimals, 0)}f}"

    def __str__(self) -> str:
        match self.style:
            case Style.GROUPED:
                return words.count(round(self.value))
            case Style.SIGNED if self.value >= 0:
                return f"+{words.fixed(self.value, self.decimals)}"
        return words.fixed(self.value, self.decimals)


@dataclass(frozen=True)
class Quantity:
    """Numbers of one `unit`, "" for none. `mark`: signs of a remark, behind them."""

    numbers: tuple[Number, ...]
    unit: str = ""
    form: Form = Form.SINGLE
    mark: str = ""

    def __str__(self) -> str:
        if self.numbers[0].style is Style.DURATION:
            return words.seconds(self.numbers[0].value)
        text = self.form.pattern.format(*self.numbers)
        return f"{text} {self.unit}{self.mark}" if self.unit else f"{text}{self.mark}"


Cell = str | Quantity
NONE: Final = (MISSING, "")
"""Cells without content."""


def fixed(value: float, decimals: int, unit: str = "", style: Style = Style.PLAIN) -> Cell:
    """`value` with these decimals; a dash for NaN or infinity."""
    return Quantity((Number(value, decimals, style),), unit) if math.isfinite(value) else MISSING


def significant(value: float, digits: int = 3, unit: str = "") -> Cell:
    """`value` with `digits` significant digits; a dash for NaN or infinity."""
    return fixed(value, words.decimals_of(value, digits), unit) if math.isfinite(value) else MISSING


def count(number: int) -> Cell:
    return fixed(number, 0, style=Style.GROUPED)


def percent(share: float, decimals: int = 0) -> Cell:
    return fixed(100 * share, decimals, "%")


def duration(seconds: float) -> Cell:
    """A duration, on the page in minutes and hours where it is long."""
    if not math.isfinite(seconds):
        return MISSING
    return fixed(seconds, words.decimals_of(seconds, 2 if seconds < 10 else 3), "s", Style.DURATION)


def speed(value: float, per: str) -> Cell:
    """A speed or an error of it, from m/s or rad/s (`per`), in mm/s or deg/s."""
    scale, unit = words.speed_unit(per)
    return significant(scale * value, 2, unit)


def with_interval(value: float, low: float, high: float, unit: str = "") -> tuple[Cell, Cell]:
    """A value and its interval, both with the decimals that the interval's half width justifies."""
    half = (high - low) / 2
    if not math.isfinite(half) or half <= 0:
        return significant(value, 4, unit), MISSING
    decimals = words.decimals_for(half)
    ends = fixed(low, decimals, unit), fixed(high, decimals, unit)
    return fixed(value, decimals, unit), joined(Form.RANGE, *ends)


def joined(form: Form, *cells: Cell) -> Cell:
    """The numbers of quantities of one unit as a quantity; a dash if any of them is missing."""
    quantities = [cell for cell in cells if isinstance(cell, Quantity)]
    if not quantities or len(quantities) < len(cells):
        return MISSING
    return replace(quantities[0], numbers=tuple(n for q in quantities for n in q.numbers), form=form)


def to_csv(columns: Sequence[str], rows: Sequence[Sequence[Cell]]) -> str:
    """A table as CSV; the first column names the rows."""
    made: list[tuple[str, ...]] = [(columns[0], *(str(row[0]) for row in rows))]
    for at in range(1, len(columns)):
        made += _column(columns[at], [row[at] for row in rows])
    text = io.StringIO()
    csv.writer(text, lineterminator="\n").writerows(zip(*made, strict=True))
    return text.getvalue()


def _column(head: str, cells: Sequence[Cell]) -> list[tuple[str, ...]]:
    """The CSV's columns of a column of cells, each with its head; a single column of text if it holds any words."""
    quantities = [cell for cell in cells if isinstance(cell, Quantity)]
    forms = {quantity.form for quantity in quantities}
    if len(forms) != 1 or any(cell not in NONE for cell in cells if not isinstance(cell, Quantity)):
        return [(head, *("" if cell == MISSING else str(cell) for cell in cells))]
    units = {quantity.unit for quantity in quantities}
    unit = units.pop() if len(units) == 1 else ""
    made = [
        (
            ", ".join(filter(None, (head, part, unit))),
            *(cell.numbers[n].plain if isinstance(cell, Quantity) else "" for cell in cells),
        )
        for n, part in enumerate(forms.pop().heads)
    ]
    if units:
        made.append((f"{head}, unit", *(cell.unit if isinstance(cell, Quantity) else "" for cell in cells)))
    if any(quantity.mark for quantity in quantities):
        made.append((f"{head}, mark", *(cell.mark if isinstance(cell, Quantity) else "" for cell in cells)))
    return made
