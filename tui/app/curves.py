"""Plots of a whole dive as lines: a solid and a dotted curve, an axis at the left, and a row of times for below."""

from dataclasses import dataclass
from typing import Final

import numpy as np

from gcs_plugin.watch.picture import Array
from tui.app import braille
from tui.app.chart import AXIS_CELLS, GRID, WITH_GRID, curve_row, tick_labels
from tui.app.lines import Line, Lines, Span, apart, cut, width
from tui.app.scale import nice_step, scale_for

LABEL_CELLS: Final = 14


@dataclass(frozen=True)
class Curve:
    """A name and its values, shape (n,)."""

    name: str
    value: Array


def plot(
    title: str, time_s: Array, solid: Curve, dotted: Curve | None, least_span: float, cells: int, rows: int
) -> Lines:
    """The plot in that many cells and rows, its title included."""
    head: Line = ((title, "plain"),)
    names: Line = (("━ ", "accent"), (solid.name, "quiet"))
    if dotted is not None:
        names = (*names, ("   ┈ ", "reference"), (dotted.name, "quiet"))
    head = (
        apart(head, names, cells) if width(head) + width(names) < cells else ((cut(title, cells), "plain"),)
    )
    across, curve_rows = cells - AXIS_CELLS, rows - 1
    if across < 1 or curve_rows < 1 or len(time_s) < 2:
        return (head,)
    both = solid.value if dotted is None else np.concatenate([solid.value, dotted.value])
    scale = scale_for(both, least_span, True, 2 if curve_rows < WITH_GRID else 4)
    edges_s = np.linspace(time_s[0], time_s[-1], braille.ACROSS * across + 1)
    drawn = [
        np.zeros((braille.UP * curve_rows, braille.ACROSS * across), dtype=bool)
        if curve is None
        else braille.curve(*braille.extremes(time_s, curve.value, edges_s), scale.low, scale.high, curve_rows)
        for curve in (solid, dotted)
    ]
    measured = braille.cells(drawn[0])
    reference = braille.cells(drawn[1] & (np.arange(braille.ACROSS * across) % 2 == 0))
    labels, no_gap = tick_labels(scale, curve_rows, False), np.zeros(across, dtype=bool)
    lines: list[Line] = [head]
    for row in range(curve_rows):
        label = labels.get(row, "")
        grid = GRID if curve_rows >= WITH_GRID and label and 0 < row < curve_rows - 1 else " "
        axis: Span = (f"{label:>{AXIS_CELLS - 1}}{'┤' if label else '│'}", "quiet")
        lines.append((axis, *curve_row(measured[row], reference[row], no_gap, grid, "accent")))
    return tuple(lines)


def seconds(time_s: Array, cells: int) -> Lines:
    """The row of times below plots of that width, at round seconds; no row if there is nothing to plot."""
    across = cells - AXIS_CELLS
    if across < 1 or len(time_s) < 2:
        return ()
    first_s, last_s = float(time_s[0]), float(time_s[-1])
    step_s = nice_step(max((last_s - first_s) * LABEL_CELLS / across, 1e-9))
    row = [" "] * across
    for place in range(int(np.ceil(first_s / step_s)), int(last_s / step_s) + 1):
        text = f"{place * step_s:g} s"
        at = round((place * step_s - first_s) / (last_s - first_s) * across)
        start = min(max(at - len(text) // 2, 0), across - len(text))
        if start >= 0:
            row[start : start + len(text)] = text
    return (((" " * AXIS_CELLS, "quiet"), ("".join(row), "quiet")),)
