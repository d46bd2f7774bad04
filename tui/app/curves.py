"""Curves in braille, four dots up and two across per cell, with an axis of round numbers; and plots of a whole dive.

From values to cells: `extremes` of each column, `dots`, `braille`, `framed` by an axis; `plot` does all of it.
"""

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from bridge.arrays import Array
from identify.words import nice_step
from tui.app.drawing import Line, Lines, Role, Span, apart, cut, number, width

BLANK: Final = 0x2800
ACROSS, UP = 2, 4
EIGHTHS: Final = " ▁▂▃▄▅▆▇█"
# Unicode chart U+2800: the bit of each dot, by row from the top and column.
_BITS: Final = np.array([[0x01, 0x08], [0x02, 0x10], [0x04, 0x20], [0x40, 0x80]])
PERIODS_OF_A_GAP: Final = 3.0

Dots = NDArray[np.bool_]
Codes = NDArray[np.int_]
Gaps = NDArray[np.bool_]
AXIS_CELLS: Final = 7
LABEL_CELLS: Final = 14
SHARED: Final = 4
"""Of the cells that hold both curves, each such one shows the reference."""
WITH_GRID: Final = 4  # rows of curve from which grid lines at the ticks help
FINEST: Final = 1e-9
"""Least span of an axis over its values: a damaged reading may be so large that a finer step would vanish in it."""
GAP: Final = "░"
GRID: Final = "┈"


def extremes(time_s: Array, value: Array, edges_s: Array) -> tuple[Array, Array]:
    """Least and greatest value, in each span between `edges_s`, of a line through the readings; NaN in its gaps.

    A gap is a NaN reading, or a silence longer than three median intervals.
    """
    low = np.full(len(edges_s) - 1, np.nan)
    high = low.copy()
    numbers = np.flatnonzero(np.isfinite(value))
    if not numbers.size:
        return low, high
    t, v = time_s[numbers], value[numbers]
    first, last = np.searchsorted(t, edges_s[:-1]), np.searchsorted(t, edges_s[1:])
    held = np.flatnonzero(first < last)
    # reduceat runs from one start to the next; the odd entries cover readings outside the spans and are dropped.
    starts = np.column_stack([first[held], last[held]]).ravel()
    padded = np.append(v, np.nan)
    low[held] = np.fmin.reduceat(padded, starts)[::2] if held.size else low[held]
    high[held] = np.fmax.reduceat(padded, starts)[::2] if held.size else high[held]
    crossing = _crossings(t, v, numbers, edges_s)
    for edge in (crossing[:-1], crossing[1:]):
        low, high = np.fmin(low, edge), np.fmax(high, edge)
    return low, high


def _crossings(t: Array, v: Array, numbers: NDArray[np.intp], edges_s: Array) -> Array:
    """Value of the line at each edge; NaN outside the line and in its gaps."""
    crossing = np.full(len(edges_s), np.nan)
    if len(t) < 2:
        return crossing
    interval = np.diff(t)
    broken = (np.diff(numbers) > 1) | (interval > PERIODS_OF_A_GAP * max(float(np.median(interval)), 1e-3))
    before = np.searchsorted(t, edges_s, side="right") - 1
    before = np.where(edges_s == t[-1], len(t) - 2, before)
    inside = np.flatnonzero((before >= 0) & (before < len(t) - 1))
    k = before[inside]
    unbroken = ~broken[k] & (interval[k] > 0)
    inside, k = inside[unbroken], k[unbroken]
    crossing[inside] = v[k] + (edges_s[inside] - t[k]) / interval[k] * (v[k + 1] - v[k])
    return crossing


def dots(low: Array, high: Array, bottom: float, top: float, rows: int) -> Dots:
    """Dots (4 rows, columns) of the spans from `low` to `high`; values out of range are drawn at the edge."""
    last = UP * rows - 1
    per_dot = last / (top - bottom)
    known = np.isfinite(low)
    upper = np.where(known, np.clip(np.rint((top - high) * per_dot), 0, last), last + 1)
    lower = np.where(known, np.clip(np.rint((top - low) * per_dot), 0, last), -1)
    row = np.arange(last + 1)[:, None]
    return np.asarray((row >= upper) & (row <= lower))


def braille(dots: Dots) -> Codes:
    """The characters (rows, columns) that show `dots`, as code points."""
    rows, columns = dots.shape[0] // UP, dots.shape[1] // ACROSS
    blocks = dots.reshape(rows, UP, columns, ACROSS)
    codes: Codes = BLANK + np.einsum("ruca,ua->rc", blocks.astype(int), _BITS)
    return codes


def eighths(low: Array, high: Array, bottom: float, top: float) -> str:
    """One row of blocks, as high as the middle of each span; blank for an empty span."""
    middle = (low + high) / 2
    level = np.clip(np.rint((middle - bottom) / (top - bottom) * 7), 0, 7)
    return "".join(EIGHTHS[int(n) + 1] if np.isfinite(n) else " " for n in level)


@dataclass(frozen=True)
class Scale:
    """An axis from `low` to `high`, both multiples of `step`."""

    low: float
    high: float
    step: float

    @property
    def digits(self) -> int:
        """Decimals that its ticks need."""
        return max(0, -math.floor(math.log10(self.step) + 1e-9))


def scale_for(values: Array, least_span: float, with_zero: bool, steps: int = 4) -> Scale:
    """Scale that covers all finite `values`: at least `least_span`, in about `steps` steps."""
    known = values[np.isfinite(values)]
    low, high = (float(known.min()), float(known.max())) if known.size else (0.0, 0.0)
    least_span = max(least_span, FINEST * abs(low), FINEST * abs(high))
    step = nice_step(max(high - low, least_span) / steps)
    if with_zero:
        low, high = min(low, 0.0), max(high, 0.0)
        if high - low < least_span:
            low, high = min(low, -least_span / 2), max(high, least_span / 2)
        step = nice_step((high - low) / steps)
    elif high - low < least_span:
        middle = step * round((low + high) / 2 / step)
        low, high = min(low, middle - least_span / 2), max(high, middle + least_span / 2)
    return Scale(step * math.floor(low / step + 1e-9), step * math.ceil(high / step - 1e-9), step)


def tick_labels(scale: Scale, rows: int, downwards: bool, turns: bool = False) -> dict[int, str]:
    """Tick labels by row: both ends first, then zero, then the rest, at least two rows apart; none in a single row.
    Of a heading that `turns`, below 360."""
    if rows == 1:
        return {}
    count = round((scale.high - scale.low) / scale.step)
    values = [scale.low + n * scale.step for n in range(count + 1)]
    by_row: dict[int, str] = {}
    for value in (values[0], values[-1], *sorted(values[1:-1], key=abs)):
        share = (value - scale.low) / (scale.high - scale.low)
        row = round((share if downwards else 1 - share) * (rows - 1))
        if all(abs(row - taken) > 1 for taken in by_row) or value in (values[0], values[-1]):
            by_row.setdefault(row, number(value % 360.0 if turns else value, scale.digits))
    return by_row


def curve_row(measured: Codes, asked: Codes, gaps: Gaps, grid: str, role: Role) -> Line:
    """A row of the curve, merged into runs of the same role."""
    spans: list[Span] = []
    columns = zip(measured.tolist(), asked.tolist(), gaps.tolist(), strict=True)
    for column, (value, reference, gap) in enumerate(columns):
        span: Span
        if value != BLANK and reference != BLANK and column % SHARED == 0:
            span = (chr(value | reference), "reference")
        elif value != BLANK:
            # Dots of the reference next to a solid line would look like part of it.
            span = (chr(value), role)
        elif reference != BLANK:
            span = (chr(reference), "reference")
        elif gap:
            span = (GAP, "rule")
        else:
            span = (grid, "rule")
        if spans and spans[-1][1] == span[1]:
            spans[-1] = (spans[-1][0] + span[0], span[1])
        else:
            spans.append(span)
    return tuple(spans)


def framed(
    measured: Codes, asked: Codes, labels: Mapping[int, str], role: Role, gaps: Gaps | None = None
) -> Lines:
    """Rows of curves behind an axis with labels by row; `gaps` are marked in the last row."""
    rows, across = measured.shape
    none = np.zeros(across, dtype=bool)
    lines: list[Line] = []
    for row in range(rows):
        label, is_last = labels.get(row, ""), row == rows - 1
        grid = GRID if rows >= WITH_GRID and label and row > 0 and not is_last else " "
        axis: Span = (f"{cut(label, AXIS_CELLS - 1):>{AXIS_CELLS - 1}}{'┤' if label else '│'}", "quiet")
        missing = gaps if gaps is not None and is_last else none
        lines.append((axis, *curve_row(measured[row], asked[row], missing, grid, role)))
    return tuple(lines)


def dotted(curve: Dots) -> Dots:
    """Every other column of a curve, which distinguishes it from a solid curve even without colour."""
    return np.asarray(curve & (np.arange(curve.shape[1]) % 2 == 0))


def time_marks(marks: Iterable[tuple[float, str]], across: int) -> Line:
    """The row below a curve: texts at shares of its width."""
    row = [" "] * across
    for share, text in marks:
        start = min(max(round(share * across) - len(text) // 2, 0), across - len(text))
        if start >= 0:
            row[start : start + len(text)] = text
    return ((" " * AXIS_CELLS, "quiet"), ("".join(row), "quiet"))


@dataclass(frozen=True)
class Curve:
    """A name and its values, shape (n,)."""

    name: str
    value: Array


def plot(
    title: str, time_s: Array, solid: Curve, other: Curve | None, least_span: float, cells: int, rows: int
) -> Lines:
    """The plot in that many cells and rows, its title included."""
    head: Line = ((title, "plain"),)
    names: Line = (("━ ", "accent"), (solid.name, "quiet"))
    if other is not None:
        names = (*names, ("   ┈ ", "reference"), (other.name, "quiet"))
    head = (
        apart(head, names, cells) if width(head) + width(names) < cells else ((cut(title, cells), "plain"),)
    )
    across, curve_rows = cells - AXIS_CELLS, rows - 1
    if across < 1 or curve_rows < 1 or len(time_s) < 2:
        return (head,)
    both = solid.value if other is None else np.concatenate([solid.value, other.value])
    scale = scale_for(both, least_span, True, 2 if curve_rows < WITH_GRID else 4)
    edges_s = np.linspace(time_s[0], time_s[-1], ACROSS * across + 1)
    drawn = [
        np.zeros((UP * curve_rows, ACROSS * across), dtype=bool)
        if curve is None
        else dots(*extremes(time_s, curve.value, edges_s), scale.low, scale.high, curve_rows)
        for curve in (solid, other)
    ]
    labels = tick_labels(scale, curve_rows, False)
    return (head, *framed(braille(drawn[0]), braille(dotted(drawn[1])), labels, "accent"))


def seconds_row(time_s: Array, cells: int) -> Lines:
    """The row of times below plots of that width, at round seconds; no row if there is nothing to plot."""
    across = cells - AXIS_CELLS
    if across < 1 or len(time_s) < 2:
        return ()
    first_s, last_s = float(time_s[0]), float(time_s[-1])
    step_s = nice_step(max((last_s - first_s) * LABEL_CELLS / across, 1e-9))
    places = range(int(np.ceil(first_s / step_s)), int(last_s / step_s) + 1)
    marks = (((n * step_s - first_s) / (last_s - first_s), f"{n * step_s:g} s") for n in places)
    return (time_marks(marks, across),)
