"""Line plots as inline SVG.

Written here, not with a plotting library: the text keeps its size on a telephone and on a wide screen
(positions are per cent of the plot, only the lines stretch), the colours follow the reader's light or dark
scheme through the page's style sheet, a page stays small, and a fresh machine has no font cache to build.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from identify.dive import Array
from identify.report.axes import Axis
from identify.report.decimate import envelope
from identify.report.text import safe

WIDTH, HEIGHT = 2000, 1000
NARROW_TICKS = 6
STYLES = ("solid", "dashed", "dotted", "dashdot")

Shape = Literal["disc", "diamond", "square", "left", "right"]

SHAPES: dict[Shape, str] = {
    "disc": '<circle r="6"/>',
    "diamond": '<path class="hollow" d="M-8 0L0-8L8 0L0 8Z"/>',
    "square": '<path d="M-6-6H6V6H-6Z"/>',
    "left": '<path d="M0 0L13-7V7Z"/>',
    "right": '<path d="M0 0L-13-7V7Z"/>',
}

BESIDE = 'x="12" y="-8"'
WORD_STANDS: dict[Shape, str] = {
    "left": 'x="4" y="-9"',
    "right": 'x="-4" y="-9" text-anchor="end"',
}
"""Where a mark's word stands: of an arrow at the edge, inside the box."""


@dataclass(frozen=True)
class Line:
    """A curve; NaN breaks it. `style` indexes STYLES, `label` is its word in the legend."""

    x: Array
    y: Array
    label: str = ""
    style: int = 0


@dataclass(frozen=True)
class Mark:
    """A symbol at a point, with a word beside it or none."""

    x: float
    y: float
    shape: Shape
    label: str = ""


@dataclass(frozen=True)
class Panel:
    """One plot. `aspect` (width over height) holds true scale; without it the plot is `height_px` high."""

    x: Axis
    y: Axis
    lines: tuple[Line, ...] = ()
    marks: tuple[Mark, ...] = ()
    height_px: int = 150
    aspect: float | None = None


def render(panel: Panel, x_labels: bool = True) -> str:
    """The panel as one `<svg>`; its text stands outside the plot's box, in the margins of the style sheet."""
    if panel.aspect is None:
        size, kind = f"height:{panel.height_px}px", "panel"
    else:
        size, kind = f"aspect-ratio:{panel.aspect:.3f};max-width:{520 * panel.aspect:.0f}px", "panel true"
    name = safe(panel.y.title or panel.x.title)
    inner = "".join(_path(line, panel) for line in panel.lines)
    return (
        f'<svg class="{kind}{"" if x_labels else " upper"}" style="{size}" role="img" aria-label="{name}">'
        f"{_frame(panel, x_labels)}"
        f'<svg viewBox="0 0 {WIDTH} {HEIGHT}" preserveAspectRatio="none" width="100%" height="100%">'
        f"{inner}</svg>"
        f"{''.join(_mark(mark, panel) for mark in panel.marks)}</svg>"
    )


def stack(panels: Sequence[Panel]) -> str:
    """Panels over one another that share their x axis, labelled at the bottom only, under one legend."""
    last = len(panels) - 1
    drawn = "".join(render(panel, i == last) for i, panel in enumerate(panels))
    return legend([line for panel in panels for line in panel.lines]) + drawn


def side_by_side(panels: Sequence[Panel]) -> str:
    """Panels in as many columns as the page has room for."""
    return f'<div class="grid">{"".join(f"<div>{render(panel)}</div>" for panel in panels)}</div>'


def legend(lines: Sequence[Line]) -> str:
    """One entry for each word, with a piece of its line; nothing where no line has a word."""
    words = {line.label: line.style for line in lines if line.label}
    entries = "".join(
        f'<li><svg width="46" height="12" aria-hidden="true"><path class="line {STYLES[style]}" d="M1 6H45"/>'
        f"</svg>{safe(word)}</li>"
        for word, style in words.items()
    )
    return f'<ul class="legend">{entries}</ul>' if entries else ""


def mark_legend(entries: Sequence[tuple[Shape, str]]) -> str:
    """What each symbol means."""
    items = "".join(
        f'<li><svg width="22" height="18" aria-hidden="true"><g class="mark" transform="translate(11 9)">'
        f"{SHAPES[shape]}</g></svg>{safe(word)}</li>"
        for shape, word in entries
    )
    return f'<ul class="legend">{items}</ul>'


def _percent(value: float) -> str:
    return f"{value:.2f}%"


def _frame(panel: Panel, x_labels: bool) -> str:
    parts = ['<rect class="box" width="100%" height="100%"/>']
    crowded = len(panel.x.ticks) > NARROW_TICKS
    for i, (value, label) in enumerate(panel.x.ticks):
        x = _percent(panel.x.percent(value))
        parts.append(f'<line class="{_grid(value, panel.x)}" x1="{x}" x2="{x}" y1="0" y2="100%"/>')
        if x_labels:
            odd = ' class="odd"' if crowded and i % 2 else ""
            parts.append(f'<text{odd} x="{x}" y="100%" dy="1.4em" text-anchor="middle">{safe(label)}</text>')
    for value, label in panel.y.ticks:
        y = _percent(100 - panel.y.percent(value))
        parts.append(f'<line class="{_grid(value, panel.y)}" x1="0" x2="100%" y1="{y}" y2="{y}"/>')
        parts.append(f'<text x="-9" y="{y}" dy=".35em" text-anchor="end">{safe(label)}</text>')
    parts.append(f'<text class="title" x="0" y="-9">{safe(panel.y.title)}</text>')
    if x_labels:
        parts.append(f'<text x="100%" y="100%" dy="2.7em" text-anchor="end">{safe(panel.x.title)}</text>')
    return "".join(parts)


def _grid(value: float, axis: Axis) -> str:
    named = axis.title == ""
    return "rule" if value == 0.0 and not named else "tick"


def _path(line: Line, panel: Panel) -> str:
    x, y = envelope(line.x, line.y)
    across, up = panel.x.fraction(x), panel.y.fraction(y)
    known = np.isfinite(across) & np.isfinite(up)
    # Far outside the box is as good as a little outside it, and keeps every coordinate short.
    px = np.rint(WIDTH * np.clip(np.where(known, across, 0.0), -1, 2)).astype(int).tolist()
    py = np.rint(HEIGHT * (1 - np.clip(np.where(known, up, 0.0), -1, 2))).astype(int).tolist()
    out: list[str] = []
    pen: tuple[int, int] | None = None
    for is_known, a, b in zip(known.tolist(), px, py, strict=True):
        if not is_known:
            pen = None
        elif pen is None:
            out.append(f"M{a} {b}l0 0")
            pen = (a, b)
        elif (a, b) != pen:
            out.append(f"{a - pen[0]} {b - pen[1]}")
            pen = (a, b)
    steps = " ".join(out).replace(" -", "-").replace(" M", "M")
    return f'<path class="line {STYLES[line.style]}" d="{steps}"/>'


def _mark(mark: Mark, panel: Panel) -> str:
    x = _percent(panel.x.percent(mark.x))
    y = _percent(100 - panel.y.percent(mark.y))
    word = f"<text {WORD_STANDS.get(mark.shape, BESIDE)}>{safe(mark.label)}</text>" if mark.label else ""
    return f'<svg class="mark" x="{x}" y="{y}">{SHAPES[mark.shape]}{word}</svg>'
