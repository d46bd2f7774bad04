"""A strip chart: the last minute of a quantity with its reference, its range, and its present value."""

import math
from dataclasses import dataclass
from typing import Final

import numpy as np

from bridge.arrays import Array, Mask
from gcs_plugin.watch.picture import Freshness, Trace
from tui.app.curves import (
    AXIS_CELLS,
    Gaps,
    Scale,
    braille,
    dots,
    dotted,
    eighths,
    extremes,
    framed,
    scale_for,
    tick_labels,
    time_marks,
)
from tui.app.drawing import NOTHING, SHOWN_IN, Line, Lines, Role, Span, ago, number, width

SPAN_S: Final = 60.0
TITLE_CELLS: Final = 10
LABEL_EVERY_S: Final = 20
WITH_TIMES: Final = 9  # rows from which a time axis fits
SMALL: Final = 3  # rows of curve below which two ticks suffice
HALF_TURN: Final = 180.0
LEAST_QUARTER: Final = 20.0  # deg: wider steps are those of a compass
FULL_TURN: Final = Scale(0.0, 360.0, 90.0)


@dataclass(frozen=True)
class Quantity:
    """One trace of a `Picture`. `least_span` and `digits` are in the displayed unit."""

    key: str
    title: str
    least_span: float
    digits: int
    with_zero: bool = False
    downwards: bool = False
    turns: bool = False


_ALL: Final = (
    Quantity("u", "surge u", 0.2, 3, with_zero=True),
    Quantity("v", "sway v", 0.2, 3, with_zero=True),
    Quantity("w", "heave w", 0.2, 3, with_zero=True),
    Quantity("r", "yaw r", 10.0, 1, with_zero=True),
    Quantity("depth", "depth", 0.5, 2, downwards=True),
    Quantity("heading", "heading", 20.0, 1, turns=True),
    Quantity("altitude", "altitude", 0.5, 2),
    Quantity("voltage", "battery", 1.0, 2),
    Quantity("p", "roll p", 10.0, 1, with_zero=True),
    Quantity("q", "pitch q", 10.0, 1, with_zero=True),
    Quantity("current", "current", 5.0, 1, with_zero=True),
)
QUANTITIES: Final = {quantity.key: quantity for quantity in _ALL}


@dataclass(frozen=True)
class _Curves:
    """Extremes per half cell of the value and of its reference; `ends_s` are the ends of whole cells."""

    value: tuple[Array, Array]
    reference: tuple[Array, Array]
    scale: Scale
    ends_s: Array


def chart(quantity: Quantity, trace: Trace | None, now_s: float, cells: int, rows: int) -> Lines:
    """The chart in that many cells and rows. One row holds the value and blocks; two or more hold a curve."""
    if trace is None or cells <= TITLE_CELLS or rows < 1:
        return (((f"{quantity.title:<{TITLE_CELLS}}", "plain"), (NOTHING, "quiet")),)
    factor = SHOWN_IN.get(trace.unit, (trace.unit, 1.0))[1]
    value = trace.value * factor
    reference = None if trace.reference is None else trace.reference * factor
    if quantity.turns:
        value, reference = _turned(value, reference, trace.time_s >= now_s - SPAN_S)
    head = _head(quantity, trace, value, None if rows == 1 else reference, cells)
    if rows == 1:
        room = cells - width(head) - 1
        curves = _curves(quantity, trace, value, None, now_s, room, 2)
        blocks = eighths(*curves.value, curves.scale.low, curves.scale.high)[::2] if room > 0 else ""
        return ((*head, (" " + blocks, _role(trace))),)
    asked = value[:0] if reference is None else reference
    seen = trace.time_s >= now_s - SPAN_S
    if not (np.isfinite(value[seen]).any() or np.isfinite(asked[seen[: asked.size]]).any()):
        return (head, *[()] * (rows - 1))  # an axis of nothing would be invented
    curve_rows = rows - 1 - (rows >= WITH_TIMES)
    across = cells - AXIS_CELLS
    curves = _curves(quantity, trace, value, reference, now_s, across, 2 if curve_rows < SMALL else 4)
    body = _body(quantity, trace, curves, curve_rows)
    if rows < WITH_TIMES:
        return (head, *body)
    ago = range(0, int(SPAN_S) + 1, LABEL_EVERY_S)
    return (head, *body, time_marks(((1 - s / SPAN_S, f"-{s} s" if s else "now") for s in ago), across))


def _role(trace: Trace) -> Role:
    return "accent" if trace.freshness is Freshness.FRESH else "faded"


def _turned(value: Array, reference: Array | None, seen: Mask) -> tuple[Array, Array | None]:
    """Headings, deg, without jumps at north, and the reference by the same turn; where the part that is `seen` turns
    by more than a whole turn, from 0 to 360, with a gap at each jump.
    """
    unwrapped = _unwrapped(value)
    if (
        np.isfinite(unwrapped[seen]).any()
        and np.ptp(unwrapped[seen][np.isfinite(unwrapped[seen])]) > FULL_TURN.high
    ):
        return _from_0_to_360(value), None if reference is None else _from_0_to_360(reference)
    if reference is None:
        return unwrapped, None
    wanted = _unwrapped(reference)
    apart = (unwrapped - wanted)[seen]
    apart = apart[np.isfinite(apart)]
    return unwrapped, wanted + (360.0 * round(float(np.median(apart)) / 360.0) if apart.size else 0.0)


def _unwrapped(heading: Array) -> Array:
    """A heading, deg, without jumps of a turn; its gaps stay."""
    known = np.isfinite(heading)
    unwrapped = heading.copy()
    unwrapped[known] = np.unwrap(heading[known], period=360.0)
    return unwrapped


def _from_0_to_360(heading: Array) -> Array:
    turned: Array = heading % 360.0
    turned[1:][np.abs(np.diff(turned)) > HALF_TURN] = np.nan
    return turned


def _text(quantity: Quantity, value: float) -> str:
    """The value; a heading from 0 to below 360."""
    return number(round(value, quantity.digits) % 360.0 if quantity.turns else value, quantity.digits)


def _head(quantity: Quantity, trace: Trace, value: Array, reference: Array | None, cells: int) -> Line:
    unit = SHOWN_IN.get(trace.unit, (trace.unit, 1.0))[0]
    now = float(value[-1]) if value.size and trace.freshness is not Freshness.GONE else math.nan
    role: Role = "strong" if trace.freshness is Freshness.FRESH else "stale"
    title: Span = (f"{quantity.title:<{TITLE_CELLS}}", "plain")
    reading: Span = (f"{_text(quantity, now):>7}", role if math.isfinite(now) else "quiet")
    line: Line = (title, reading, (f" {unit:<5}", "quiet" if role == "strong" else "stale"))
    if trace.freshness is not Freshness.FRESH:
        return (*line, (f" {ago(trace.age_s)}", "stale"))
    if reference is None or not reference.size:
        return line
    wanted = f"{_text(quantity, float(reference[-1])):>8}"
    longer: Line = (*line, ("  ref", "reference"), (wanted, "reference"))
    return longer if width(longer) <= cells else line


def _curves(
    quantity: Quantity,
    trace: Trace,
    value: Array,
    reference: Array | None,
    now_s: float,
    across: int,
    steps: int,
) -> _Curves:
    cell_s = SPAN_S / max(across, 1)
    # Advance by whole cells of time, so that a curve shifts by cells and keeps its shape in between.
    end_s = math.ceil(now_s / cell_s) * cell_s
    edges_s = end_s - cell_s / 2 * np.arange(2.0 * max(across, 1), -1.0, -1.0)
    seen = trace.time_s >= edges_s[0]
    within = value[seen] if reference is None else np.concatenate([value[seen], reference[seen]])
    scale = scale_for(within, quantity.least_span, quantity.with_zero, steps)
    if quantity.turns and scale.step > LEAST_QUARTER:
        scale = _compass(within)
    nothing = np.full(len(edges_s) - 1, np.nan)
    wanted = (nothing, nothing) if reference is None else extremes(trace.time_s, reference, edges_s)
    measured = extremes(trace.time_s, value, edges_s)
    if quantity.turns:
        measured, wanted = _unbroken(*measured), _unbroken(*wanted)
    return _Curves(measured, wanted, scale, edges_s[2::2])


def _compass(headings: Array) -> Scale:
    """A scale with ticks at the points of the compass."""
    low, high = float(np.nanmin(headings)), float(np.nanmax(headings))
    step = 45.0 if high - low <= HALF_TURN else 90.0
    return Scale(step * math.floor(low / step), step * math.ceil(high / step), step)


def _unbroken(low: Array, high: Array) -> tuple[Array, Array]:
    """Remove the jumps from 360 to 0."""
    return np.where(high - low > HALF_TURN, high, low), high


def _body(quantity: Quantity, trace: Trace, curves: _Curves, rows: int) -> Lines:
    scale, (low, high), (asked_low, asked_high) = curves.scale, curves.value, curves.reference
    bottom, top = scale.low, scale.high
    if quantity.downwards:
        bottom, top = -top, -bottom
        (low, high), (asked_low, asked_high) = (-high, -low), (-asked_high, -asked_low)
    measured = braille(dots(low, high, bottom, top, rows))
    wanted = braille(dotted(dots(asked_low, asked_high, bottom, top, rows)))
    begun = np.flatnonzero(np.isfinite(low))
    silent: Gaps = np.all(np.isnan(low).reshape(-1, 2), axis=1)
    silent[: begun[0] // 2 if begun.size else len(silent)] = False
    if trace.freshness is Freshness.FRESH and trace.time_s.size:
        silent &= curves.ends_s <= trace.time_s[-1]  # a period that is still running is no gap
    labels = tick_labels(scale, rows, quantity.downwards, quantity.turns)
    return framed(measured, wanted, labels, _role(trace), silent)
