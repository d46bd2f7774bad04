"""Curves over time that a reader can zoom: panels over a shared time axis, stretched in time and in height by buttons.

The style sheet alone stretches the curves, without a script; lines keep their width, and times and values stay text.
As long as nothing is stretched, the scale covers no curve.
"""

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from bridge.arrays import Array
from identify.words import fixed, nice_step, safe

ZOOMS = (1, 4, 16)
"""Stretches of the time axis, in widths of the page."""

TICKS = 8
"""Number of times shown beneath a page's width."""

WIDE, HIGH = 10_000, 1_000
"""Units of the drawing: a tenth of a pixel on a wide screen at the smallest zoom."""

MOST_POINTS = 3_000
"""Most points of a curve: with six panels of four curves a page stays below 1 MB."""

HEIGHTS = (1, 4)
"""Stretches of a panel's height, in heights as STYLE gives them."""

SILENT_STEPS, SILENT_S = 5.0, 1.0
"""The first curve of a panel breaks at a longer step, in usual steps and in s: between two runs nothing is known."""


@dataclass(frozen=True)
class Traces:
    """Panels above each other: their titles, and their curves (k, n), one for each of the k `labels`.

    time_s (n,), from 0. block (n,): curves break where it changes, except the first curve of each panel, which breaks
    between runs alone. NaN breaks a curve. `kinds` are the labels' classes in STYLE.
    """

    name: str
    caption: str
    labels: tuple[str, ...]
    time_s: Array
    block: NDArray[np.intp]
    panels: tuple[tuple[str, Array], ...]
    kinds: tuple[str, ...] = ("curve0", "curve1", "curve2")


MODES = ("mode0", "mode1", "mode2", "mode3")

STYLE = """
.traces { position: relative; }
.traces input { position: absolute; opacity: 0; }
.traces label { display: inline-block; margin: 0 .5em .5em 0; padding: .1em .7em; border: 2px solid var(--rule);
  border-radius: 4px; cursor: pointer; }
.traces input:checked + label { background: var(--first); border-color: var(--first); color: var(--ground); }
.traces input:focus-visible + label { outline: 3px solid var(--second); }
.key { display: flex; flex-wrap: wrap; gap: 0 1.4em; list-style: none; margin: 0; padding: 0; }
.key svg { width: 36px; height: 12px; margin-right: .4em; }
.pane { overflow: auto hidden; --high: 130px; }
.high4:checked ~ .pane { --high: 520px; }
.zooms { display: inline-block; margin-right: .4em; color: var(--soft); }
.band { position: relative; box-sizing: border-box; width: 100%; padding: 0 3em 0 4em; }
.zoom4:checked ~ .pane .band { width: 400%; }
.zoom16:checked ~ .pane .band { width: 1600%; }
.band svg { display: block; width: 100%; height: var(--high); border-bottom: 2px solid var(--rule); }
.band p { position: sticky; left: 0; margin: .6em 0 0 -4em; width: max-content;
  max-width: 90vw; font-weight: 600; }
.scale { position: sticky; left: 0; margin-left: -4em; width: 4em; height: 0; }
.scale span { position: absolute; right: 0; transform: translateY(-50%); padding: 0 .4em 0 .2em;
  font-size: .75em; line-height: 1; color: var(--soft); background: var(--ground); white-space: nowrap; }
.times { position: relative; height: 1.6em; font-size: .85em; color: var(--soft); }
.times span { position: absolute; padding-left: .2em; border-left: 1px solid var(--rule); white-space: nowrap; }
@media screen and (max-width: 700px) { .zoom1:checked ~ .pane .between { display: none; } }
.times .at4, .times .at16 { display: none; }
.zoom4:checked ~ .pane .at4, .zoom16:checked ~ .pane .at4, .zoom16:checked ~ .pane .at16 { display: inline; }
.curve { fill: none; stroke-width: 1.6; vector-effect: non-scaling-stroke; }
.curve0 { stroke: var(--ink); stroke-width: 2.4; }
.curve1 { stroke: var(--second); stroke-dasharray: 6 3; }
.curve2 { stroke: var(--first); }
.mode0 { stroke: var(--first); }
.mode1 { stroke: var(--second); stroke-dasharray: 7 3; }
.mode2 { stroke: var(--third); stroke-dasharray: 2 2; stroke-width: 2; }
.mode3 { stroke: var(--fourth); stroke-dasharray: 9 2 2 2; }
.reference { stroke: var(--reference); stroke-dasharray: 5 2; stroke-width: 2; }
.grid { stroke: var(--tick); stroke-width: 1; vector-effect: non-scaling-stroke; }
@media print { .traces input, .traces label { display: none; } .band { width: 100%; min-width: 0; } }
"""
"""curve0 to curve2: measured, before, after; mode0 to mode3: dives over each other, in the order of `plot.STYLES`."""


def render(traces: Traces, key: str) -> str:
    """Render as HTML. key: makes the ids of its buttons unique in the page."""
    kept, runs = _thinned(traces)
    buttons = '<span class="zooms">in time</span>' + "".join(
        f'<input type="radio" class="zoom{by}" name="{key}" id="{key}-{by}"{" checked" if by == ZOOMS[0] else ""}>'
        f'<label for="{key}-{by}">{"whole" if by == ZOOMS[0] else f"{by} times"}</label>'
        for by in ZOOMS
    )
    buttons += f'<br><span class="zooms">in height</span>{_heights(key)}'
    words = "".join(
        f'<li><svg viewBox="0 0 36 12" aria-hidden="true"><path class="curve {kind}" d="M0 6H36"/></svg>'
        f"{safe(label)}</li>"
        for kind, label in zip(kept.kinds, kept.labels, strict=False)
    )
    span_s = float(kept.time_s[-1]) if len(kept.time_s) else 0.0
    known = [(title, curves) for title, curves in kept.panels if np.isfinite(curves).any()]
    band = "".join(_panel(title, curves, kept, runs, span_s) for title, curves in known) + _times(span_s)
    return (
        f'<figure class="traces" aria-label="{safe(traces.name)}">\n<ul class="key">{words}</ul>\n{buttons}\n'
        f'<div class="pane" tabindex="0"><div class="band">\n{band}</div></div>\n'
        f"<figcaption>{safe(traces.caption)}</figcaption></figure>\n"
    )


def _heights(key: str) -> str:
    return "".join(
        f'<input type="radio" class="high{by}" name="{key}-h" id="{key}-h{by}"{" checked" if by == HEIGHTS[0] else ""}>'
        f'<label for="{key}-h{by}">{"whole" if by == HEIGHTS[0] else f"{by} times"}</label>'
        for by in HEIGHTS
    )


def _thinned(traces: Traces) -> tuple[Traces, NDArray[np.intp]]:
    """Every k-th instant, and the ends of every block and run; with the number of the run of each."""
    runs = _runs(traces.time_s)
    every = -(-len(traces.time_s) // MOST_POINTS)
    if every <= 1:
        return traces, runs
    ends = np.flatnonzero(np.diff(traces.block) | np.diff(runs))
    at = np.unique(np.concatenate([np.arange(0, len(traces.time_s), every), ends, ends + 1]))
    panels = tuple((title, curves[:, at]) for title, curves in traces.panels)
    return replace(traces, time_s=traces.time_s[at], block=traces.block[at], panels=panels), runs[at]


def _panel(title: str, curves: Array, of: Traces, runs: NDArray[np.intp], span_s: float) -> str:
    low, high = float(np.nanmin(curves)), float(np.nanmax(curves))
    room = 0.05 * (high - low) or 1.0
    low, high = low - room, high + room
    across = WIDE * of.time_s / max(span_s, 1e-9)
    step = nice_step((high - low) / 6)
    lines = [(value, (high - value) / (high - low)) for value in _multiples(step, low, high)]
    grid = "".join(f'<path class="grid" d="M0 {HIGH * down:.0f}H{WIDE}"/>' for _, down in lines)
    scale = "".join(
        f'<span style="top:calc({down:.3f}*var(--high))">{_rounded(value, step)}</span>'
        for value, down in lines
    )
    paths = "".join(
        f'<path class="curve {of.kinds[k]}" '
        f'd="{_path(across, HIGH * (high - curve) / (high - low), of.block if k else runs)}"/>'
        for k, curve in enumerate(curves)
        if np.isfinite(curve).any()
    )
    return (
        f'<p>{safe(title)}</p><div class="scale">{scale}</div>'
        f'<svg viewBox="0 0 {WIDE} {HIGH}" preserveAspectRatio="none" role="img" '
        f'aria-label="{safe(title)}">{grid}{paths}</svg>\n'
    )


def _runs(time_s: Array) -> NDArray[np.intp]:
    """Number (n,) of the run of each time: one ends where nothing is for long."""
    steps = np.diff(time_s, prepend=time_s[:1])
    usual = float(np.median(steps)) if len(steps) else 0.0
    return np.cumsum(steps > max(SILENT_STEPS * usual, SILENT_S))


def _path(across: Array, down: Array, block: NDArray[np.intp]) -> str:
    """Path in relative steps, which are shorter than positions; a new start with every block and after a NaN.

    Each start has a step of none, as a lone reading has no other: a browser draws no further than a command without
    numbers.
    """
    known = np.isfinite(down)
    stretch = np.cumsum(~known)[known]
    x, y, block = np.round(across[known]).astype(int), np.round(down[known]).astype(int), block[known]
    starts = (np.diff(block, prepend=block[:1]) != 0) | (np.diff(stretch, prepend=stretch[:1]) != 0)
    starts[:1] = True
    dx, dy = np.diff(x, prepend=0).tolist(), np.diff(y, prepend=0).tolist()
    parts = [
        f"M{x[i]} {y[i]}l0 0" if begins else f"{dx[i]} {dy[i]}" for i, begins in enumerate(starts.tolist())
    ]
    return " ".join(parts).replace(" M", "M").replace(" -", "-")


def _times(span_s: float) -> str:
    """Seconds beneath the panels; more of them show at higher zoom, and every other one where a phone shows all."""
    out, shown = "", set()
    for by in ZOOMS:
        step = nice_step(span_s / (TICKS * by))
        for k, at_s in enumerate(_multiples(step, 0.0, span_s)):
            if round(at_s, 3) not in shown and span_s > 0:
                shown.add(round(at_s, 3))
                kind = f' class="at{by}"' if by != ZOOMS[0] else ' class="between"' if k % 2 else ""
                out += f'<span{kind} style="left:{100 * at_s / span_s:.3f}%">{_rounded(at_s, step)} s</span>'
    return f'<div class="times">{out}</div>\n'


def _multiples(step: float, low: float, high: float) -> list[float]:
    return [k * step for k in range(math.ceil(low / step), math.floor(high / step) + 1)]


def _rounded(value: float, step: float) -> str:
    return fixed(value, max(0, -math.floor(math.log10(step))))
