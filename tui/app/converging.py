"""A value and its 95 % interval over the passes of an estimator, as lines (the paper's Figs 7 and 9)."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from gcs_plugin.watch.picture import Array
from tui.app import braille
from tui.app.chart import AXIS_CELLS, curve_row
from tui.app.lines import Line, Lines, Span, apart, cut
from tui.progress import Report
from tui.show import number as significant

LEAST_PASSES: Final = 4
LEAST_SPAN: Final = 0.001  # share of the value, so that a constant value still has an axis
SMALLEST: Final = 1e-9


@dataclass(frozen=True)
class Passes:
    """One parameter: `value` after each pass and `half` of its interval, both of the same length, in its own unit."""

    name: str
    value: Array
    half: Array


def passes_of(told: Sequence[Report]) -> tuple[Passes, ...]:
    """Collect the passes of each parameter from the reports; NaN for a pass that omits it."""
    steps = [values for report in told if not report.answered and (values := report.values)]
    names = dict.fromkeys(name for values in steps for name in values)
    nothing = (np.nan, np.nan)
    return tuple(
        Passes(name, *np.array([values.get(name, nothing) for values in steps], dtype=float).T)
        for name in names
    )


def converging(passes: Passes, unit: str, cells: int, rows: int, beside: str = "") -> Lines:
    """The present value and interval, and curves of both: the value as a solid step curve, the interval's ends
    dotted. `beside` is the value by other methods; while it is "", the number of passes takes its place.
    """
    value, half = passes.value, passes.half
    head: Line = ((f"{passes.name:<6}", "plain"), (f"{significant(float(value[-1])):>8}", "strong"))
    interval: Line = ((f" ± {significant(float(half[-1]), 2)}", "reference"), (f" {unit}", "quiet"))
    head = (*head, *interval)
    across = cells - AXIS_CELLS
    if rows < 2 or across < 1:
        return (_cut(head, cells),)
    head = apart(head, ((beside or f"pass {len(value)}", "reference" if beside else "quiet"),), cells)
    bottom, top = _range(value, half)
    count = max(len(value), LEAST_PASSES)
    low, middle, high = (
        _dots(curve, count, across, bottom, top, rows - 1) for curve in (value - half, value, value + half)
    )
    dotted = (low | high) & (np.arange(middle.shape[1]) % 2 == 0)
    measured, asked = braille.cells(middle), braille.cells(dotted)
    # An interval narrower than a row shows only in the cells of the value.
    measured = np.where(measured != braille.BLANK, measured | asked, measured)
    # A single row can't carry labels for both ends.
    labels = {0: significant(top), rows - 2: significant(bottom)} if rows > 2 else {}
    lines: list[Line] = [_cut(head, cells)]
    for row in range(rows - 1):
        label = labels.get(row, "")
        axis: Span = (f"{cut(label, AXIS_CELLS - 1):>{AXIS_CELLS - 1}}{'┤' if label else '│'}", "quiet")
        gaps = np.zeros(across, dtype=bool)
        lines.append((axis, *curve_row(measured[row], asked[row], gaps, " ", "accent")))
    return tuple(lines)


def _range(value: Array, half: Array) -> tuple[float, float]:
    """Lowest and highest end of any interval, so that all rows are used."""
    low, high = float(np.nanmin(value - half)), float(np.nanmax(value + half))
    least = max(LEAST_SPAN * max(abs(low), abs(high)), SMALLEST)
    return (low, high) if high - low >= least else (low - least / 2, high + least / 2)


def _dots(curve: Array, count: int, across: int, low: float, high: float, rows: int) -> braille.Dots:
    """Dots of a step curve over `count` passes, with vertical joints; blank for passes that have not happened yet."""
    padded = np.append(curve, np.full(count - len(curve), np.nan))
    columns = padded[(np.arange(braille.ACROSS * across) * count) // (braille.ACROSS * across)]
    before = np.append(columns[:1], columns[:-1])
    known = np.isfinite(columns)
    bottom = np.where(known, np.fmin(columns, before), np.nan)
    return braille.curve(bottom, np.where(known, np.fmax(columns, before), np.nan), low, high, rows)


def _cut(line: Line, cells: int) -> Line:
    """The line, cut to `cells`."""
    room, spans = cells, []
    for text, role in line:
        spans.append((text[:room], role))
        room -= len(spans[-1][0])
    return tuple(span for span in spans if span[0])
