"""An identification under way, as lines: a bar for each method, the values after each pass, and how it ended."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Final

import numpy as np

from bridge.arrays import Array
from bridge.reports import PAGE, UNKEPT, Report
from bridge.vehicle.coefficients import OF_HULL
from tui.app.curves import ACROSS, AXIS_CELLS, BLANK, Dots, braille, dots, dotted, framed
from tui.app.drawing import NOTHING, Line, Lines, abreast, apart, cut, stopwatch, titled, width
from tui.app.jobs import JobState
from tui.show import number as significant

LEAST_PASSES: Final = 4
LEAST_SPAN: Final = 0.001  # share of the value, so that a constant value still has an axis
SMALLEST: Final = 1e-9
BAR_CELLS: Final = 24
NAME_CELLS: Final = 12
WIDE: Final = 120  # cells from which four charts fit side by side
BETWEEN_CHARTS: Final = 3
REFUSED: Final = "not identified"


@dataclass(frozen=True)
class Passes:
    """One parameter: `value` after each pass and `half` of its interval, both of the same length, in its own unit."""

    name: str
    value: Array
    half: Array


def passes_of(reports: Sequence[Report]) -> tuple[Passes, ...]:
    """Collect the passes of each parameter from the reports; NaN for a pass that omits it."""
    steps = [values for report in reports if not report.answered and (values := report.values)]
    names = dict.fromkeys(name for values in steps for name in values)
    nothing = (np.nan, np.nan)
    return tuple(
        Passes(name, *np.array([values.get(name, nothing) for values in steps], dtype=float).T)
        for name in names
    )


def converging(
    passes: Passes, unit: str, cells: int, rows: int, others: str = "", *, refused: bool = False
) -> Lines:
    """The present value and interval, and curves of both: the value as a solid step curve, the interval's ends
    dotted. `others` are the values by other methods; while they are "", the number of passes takes their place.
    `refused`: the method has answered, and does not tell this parameter: its last pass is no value.
    """
    value, half = passes.value, passes.half
    head: Line = ((f"{passes.name:<6}", "plain"),)
    if refused:
        head = (*head, (f"{NOTHING:>8} {REFUSED}", "warn"))
    else:
        head = (
            *head,
            (f"{significant(float(value[-1])):>8}", "strong"),
            (f" ± {significant(float(half[-1]), 2)}", "reference"),
            (f" {unit}", "quiet"),
        )
    if width(head) > cells:
        # Where a column is too narrow for a table of values, the unit is worth more than their places.
        head = ((passes.name, "plain"), *((f" {text.strip()}", role) for text, role in head[1:]))
    across = cells - AXIS_CELLS
    if rows < 2 or across < 1:
        return (_cut(head, cells),)
    head = apart(head, ((others or f"pass {len(value)}", "reference" if others else "quiet"),), cells)
    bottom, top = _range(value, half)
    count = max(len(value), LEAST_PASSES)
    low, middle, high = (
        _dots(curve, count, across, bottom, top, rows - 1) for curve in (value - half, value, value + half)
    )
    measured, asked = braille(middle), braille(dotted(low | high))
    # An interval narrower than a row shows only in the cells of the value.
    measured = np.where(measured != BLANK, measured | asked, measured)
    # A single row can't carry labels for both ends.
    labels = {0: significant(top), rows - 2: significant(bottom)} if rows > 2 else {}
    return (_cut(head, cells), *framed(measured, asked, labels, "accent"))


def _range(value: Array, half: Array) -> tuple[float, float]:
    """Lowest and highest end of any interval, so that all rows are used."""
    low, high = float(np.nanmin(value - half)), float(np.nanmax(value + half))
    least = max(LEAST_SPAN * max(abs(low), abs(high)), SMALLEST)
    return (low, high) if high - low >= least else (low - least / 2, high + least / 2)


def _dots(curve: Array, count: int, across: int, low: float, high: float, rows: int) -> Dots:
    """Dots of a step curve over `count` passes, with vertical joints; blank for passes that have not happened yet."""
    padded = np.append(curve, np.full(count - len(curve), np.nan))
    columns = padded[(np.arange(ACROSS * across) * count) // (ACROSS * across)]
    before = np.append(columns[:1], columns[:-1])
    known = np.isfinite(columns)
    bottom = np.where(known, np.fmin(columns, before), np.nan)
    return dots(bottom, np.where(known, np.fmax(columns, before), np.nan), low, high, rows)


def _cut(line: Line, cells: int) -> Line:
    room, spans = cells, []
    for text, role in line:
        spans.append((text[:room], role))
        room -= len(spans[-1][0])
    return tuple(span for span in spans if span[0])


def progress(state: JobState, now_s: float, cells: int, goes_on: bool = False) -> Lines:
    """A bar per method and the elapsed time; once the values exist, a bar for the page being written.

    `goes_on`: the screen Parameters opens as soon as the values exist.
    """
    newest = {report.of: report for report in state.reports}
    page = newest.pop(PAGE, None)
    newest.pop(UNKEPT, None)
    if page is not None and state.runs:
        return (_bar(PAGE, page, cells),)
    clock = stopwatch((state.ended_s if state.ended_s is not None else now_s) - state.began_s)
    then = "then parameters, " if goes_on and state.runs else ""
    stage = "STOPPING" if state.cancelled else "IDENTIFYING"
    title = f"{stage if state.runs else 'CURVES OF'} {Path(state.words[1]).name}"
    lines: list[Line] = [*titled(title, then + clock, cells)]
    if not newest and state.runs:
        lines.append((("reading the dive", "quiet"),))
    at_work = not all(report.answered for report in newest.values())
    for method, report in newest.items():
        note = ": its values stand behind vs" if report.answered and at_work else ""
        lines.append(_bar(method, replace(report, words=f"{report.words}{note}"), cells))
    return tuple(lines)


def _bar(method: str, report: Report, cells: int) -> Line:
    full = round(min(max(report.share, 0.0), 1.0) * BAR_CELLS)
    line: Line = (
        (f"{cut(method, NAME_CELLS):<{NAME_CELLS}}", "plain"),
        ("█" * full, "accent"),
        ("░" * (BAR_CELLS - full), "rule"),
        (f" {100 * report.share:>3.0f} %  ", "strong"),
    )
    return (*line, (cut(report.words, max(cells - width(line), 0)), "quiet"))


def curves(reports: Sequence[Report], cells: int, rows: int) -> Lines:
    """A chart per reported parameter in a grid that fills the space, next to it the values of other methods."""
    passes, answered = passes_of(reports), answers(reports)
    if not passes:
        return _answers(answered, cells)
    method_shown = next(item.of for item in reports if item.values and not item.answered)
    compared = {method: values for method, values in answered.items() if method != method_shown}
    answer = answered.get(method_shown)
    columns = 4 if cells >= WIDE else 2
    below = -(-len(passes) // columns)
    each, (high, left) = cells // columns, divmod(rows, below)
    lines: list[Line] = []
    for row in range(below):
        charts = [
            converging(
                item,
                _unit(item.name),
                each - BETWEEN_CHARTS,
                high + (row < left),
                _values(compared, item.name),
                refused=answer is not None and item.name not in answer,
            )
            for item in passes[row * columns : (row + 1) * columns]
        ]
        for y in range(max(map(len, charts))):
            lines.append(abreast([chart[y] if y < len(chart) else () for chart in charts], each))
    return tuple(lines)


def answers(reports: Sequence[Report]) -> dict[str, dict[str, tuple[float, float]]]:
    """Answers by method: each value with half of its 95 % interval."""
    return {report.of: dict(report.values) for report in reports if report.answered and report.values}


def _answers(answered: Mapping[str, Mapping[str, tuple[float, float]]], cells: int) -> Lines:
    """The values of the methods that have answered, one parameter per line."""
    return tuple(
        (
            (f"{name:<6}", "plain"),
            (f"{significant(value):>8}", "strong"),
            (f" ± {significant(half, 2)}", "reference"),
            (cut(f" {_unit(name)}  by {method}", cells - 18), "quiet"),
        )
        for method, values in answered.items()
        for name, (value, half) in values.items()
    )


def _values(answered: Mapping[str, Mapping[str, tuple[float, float]]], name: str) -> str:
    """Values of a parameter by the other methods that have answered."""
    return ", ".join(
        f"vs {significant(by_name[name][0]) if name in by_name else NOTHING}" for by_name in answered.values()
    )


def _unit(name: str) -> str:
    return OF_HULL[name].unit if name in OF_HULL else ""
