"""Curves in braille, four dots up and two across per cell; and in eighths of a cell, for a single row."""

from typing import Final

import numpy as np
from numpy.typing import NDArray

from gcs_plugin.watch.picture import Array

BLANK: Final = 0x2800
ACROSS, UP = 2, 4
EIGHTHS: Final = " ▁▂▃▄▅▆▇█"
# Unicode chart U+2800: the bit of each dot, by row from the top and column.
_BITS: Final = np.array([[0x01, 0x08], [0x02, 0x10], [0x04, 0x20], [0x40, 0x80]])
PERIODS_OF_A_GAP: Final = 3.0

Dots = NDArray[np.bool_]


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


def curve(low: Array, high: Array, bottom: float, top: float, rows: int) -> Dots:
    """Dots (4 rows, columns) of the spans from `low` to `high`; values out of range are drawn at the edge."""
    last = UP * rows - 1
    per_dot = last / (top - bottom)
    known = np.isfinite(low)
    upper = np.where(known, np.clip(np.rint((top - high) * per_dot), 0, last), last + 1)
    lower = np.where(known, np.clip(np.rint((top - low) * per_dot), 0, last), -1)
    row = np.arange(last + 1)[:, None]
    return np.asarray((row >= upper) & (row <= lower))


def cells(dots: Dots) -> NDArray[np.int_]:
    """The characters (rows, columns) that show `dots`, as code points."""
    rows, columns = dots.shape[0] // UP, dots.shape[1] // ACROSS
    blocks = dots.reshape(rows, UP, columns, ACROSS)
    codes: NDArray[np.int_] = BLANK + np.einsum("ruca,ua->rc", blocks.astype(int), _BITS)
    return codes


def eighths(low: Array, high: Array, bottom: float, top: float) -> str:
    """One row of blocks, as high as the middle of each span; blank for an empty span."""
    middle = (low + high) / 2
    level = np.clip(np.rint((middle - bottom) / (top - bottom) * 7), 0, 7)
    return "".join(EIGHTHS[int(n) + 1] if np.isfinite(n) else " " for n in level)
