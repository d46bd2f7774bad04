"""An identification, beside the values accepted before, as lines."""

import math
from collections.abc import Sequence
from itertools import zip_longest
from typing import Final

from identify.words import capital
from tui.app.drawing import Line, Lines, Role, abreast, day, hanging, number, stacked, titled, width
from tui.app.identification import Identified, Value
from tui.show import number as significant

BETWEEN: Final = 3  # cells between the table and what stands beside it
LEAST_SIDE_CELLS: Final = 48  # cells, below which reasons and notes come under the table
NAMED, ACCEPTED = f"{'':7}", f"{'accepted':>8} →"
AFTER: Final = (
    f"{'value':>8}",
    f"{'change':>9}",
    f"  {'unit':<12}",
    f"  {'95 % interval':<15}",
    f"  {'given the thrust':<17}",
)
"""Heads of the columns; those at the end are left out where they have no room."""


def result(shown: Identified, cells: int) -> Lines:
    """The outcome in a sentence, the doubts in full, parameters next to last accepted values; then reasons and notes,
    beside the parameters as far as there is room.
    """
    good = shown.outcome == "converged" and not shown.doubts
    lines: list[Line] = [
        *titled(f"{shown.dive} {shown.configuration}", f"{day(shown.written_unix_s)} UTC", cells)
    ]
    lines += hanging(_outcome(shown), "strong" if good else "warn", cells)
    lines += stacked(shown.comparison.sentences if shown.comparison else (), "plain", cells, hanging)
    lines += stacked((f"▲ {doubt}" for doubt in shown.doubts), "warn", cells, hanging)
    reasons = list(dict.fromkeys(value.reason for value in shown.values if value.reason))
    rows: list[Line] = []
    if shown.count:
        again = any(math.isfinite(value.accepted) for value in shown.values)
        columns = (NAMED, ACCEPTED, *AFTER) if again else (NAMED, AFTER[0], *AFTER[2:])
        rows.append(_fitting(tuple((head, "quiet") for head in columns), cells))
        rows += [_fitting(_row(value, reasons, again=again), cells) for value in shown.values]
    left = max(map(width, rows), default=0) + BETWEEN
    height = len(rows) if cells - left >= LEAST_SIDE_CELLS else 0
    side: list[Line] = []
    below: list[Line] = []
    remarks: list[tuple[str, Role]] = [(f"{n}: {reason}", "warn") for n, reason in enumerate(reasons, 1)]
    for remark, role in (*remarks, *((note, "quiet") for note in shown.notes)):
        if len(side) < height:
            side += hanging(remark, role, cells - left)
        else:
            below += hanging(remark, role, cells)
    return (*lines, *(abreast(pair, left) for pair in zip_longest(rows, side, fillvalue=())), *below)


def _outcome(shown: Identified) -> str:
    second = shown.comparison
    other = f"; by {second.method}: {second.outcome}" if second else ""
    counts = f"{shown.count} of {len(shown.coefficients)}"
    return f"{capital(shown.outcome)}: {counts} coefficients identified by {shown.method}{other}."


def _fitting(columns: Line, cells: int) -> Line:
    return tuple(span for n, span in enumerate(columns) if width(columns[: n + 1]) <= cells)


def _row(value: Value, reasons: Sequence[str], *, again: bool) -> Line:
    """A row of the table; `again`: some values were accepted before."""
    blank: Line = ((" " * len(ACCEPTED), "quiet"),) if again else ()
    if not math.isfinite(value.value):
        why = f"no, see {1 + reasons.index(value.reason)}" if value.reason else "no"
        return ((f"{value.name:<7}", "plain"), *blank, (f"{'--':>8}  ", "quiet"), (why, "warn"))
    interval = f"{significant(value.low95, 3)} … {significant(value.high95, 3)}"
    given = " … ".join(map(significant, value.given))
    was, change = blank, ((" " * len(AFTER[1]), "quiet"),) if again else ()
    if math.isfinite(value.accepted):
        was = ((f"{significant(value.accepted):>8}", "plain"), (" →", "quiet"))
        change = ((f"{_signed(100 * value.change):>7} %", "warn" if value.is_news else "plain"),)
    return (
        (f"{value.name:<7}", "plain"),
        *was,
        (f"{significant(value.value):>8}", "strong"),
        *change,
        (f"  {value.unit:<12}", "quiet"),
        (f"  {interval:<15}", "plain"),
        (f"  {given:<17}", "quiet"),
    )


def _signed(value: float) -> str:
    text = number(value, 1)
    return f"+{text}" if value > 0 and float(text) else text
