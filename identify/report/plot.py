"""Plots with matplotlib, in the page's colours. A draw function takes a width: that of the page, or of a column.

Only matplotlib's objects are used, never its global state; `picture` sets the style while they are drawn.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.figure import Figure as Picture

from identify.dive import Array
from identify.report.theme import LIGHT

if TYPE_CHECKING:
    from matplotlib.axes import Axes

Draw = Callable[[float], Picture]
"""Draws a figure at a width in inches."""

STYLES: tuple[dict[str, Any], ...] = (
    {"color": LIGHT["first"], "linestyle": "-", "linewidth": 1.4},
    {"color": LIGHT["second"], "linestyle": (0, (5, 2)), "linewidth": 1.6},
    {"color": LIGHT["third"], "linestyle": (0, (1, 1.5)), "linewidth": 1.9},
    {"color": LIGHT["fourth"], "linestyle": (0, (7, 1.5, 1.5, 1.5)), "linewidth": 1.7},
)
"""Each style has its own colour and dash, so that lines are distinct without colour."""

DISC: dict[str, Any] = {"marker": "o", "color": LIGHT["ink"], "linestyle": "", "zorder": 3}
DIAMOND: dict[str, Any] = {
    "marker": "D", "color": LIGHT["second"], "linestyle": "", "markerfacecolor": LIGHT["ground"],
    "markeredgewidth": 1.5, "zorder": 3,
}  # fmt: skip
SQUARE: dict[str, Any] = {"marker": "s", "color": LIGHT["ink"], "linestyle": "", "zorder": 3}

NARROW_IN = 6.0
LEGEND_IN, LETTER_IN = 0.55, 0.085
"""Width of a legend entry without its word, and of a letter."""


@dataclass(frozen=True)
class Line:
    """A curve; NaN breaks it. `style` indexes STYLES, `label` is its word in the legend."""

    x: Array
    y: Array
    label: str = ""
    style: int = 0


@dataclass(frozen=True)
class Panel:
    """A plot: the function that draws into its box, and its height."""

    draw: Callable[["Axes"], None]
    height_in: float = 1.7


def lines_panel(
    title: str,
    x_title: str,
    lines: Sequence[Line],
    x: tuple[float, float] | None = None,
    holds: Sequence[float] = (),
    height_in: float = 1.7,
) -> Panel:
    """Curves under a title. x: limits of the x axis; holds: values that the y axis must include."""

    def draw(box: "Axes") -> None:
        for line in lines:
            box.plot(line.x, line.y, label=line.label or None, **STYLES[line.style])
        if holds:
            box.dataLim.update_from_data_y(np.array(holds), ignore=False)
            box.autoscale_view()
        if x is not None and x[1] > x[0]:
            box.set_xlim(*x)
        entitle(box, title, x_title)

    return Panel(draw, height_in)


def entitle(box: "Axes", title: str, x_title: str) -> None:
    """Set the titles of the axes, and draw the line at zero if it is in view."""
    box.set_title(title, loc="left")
    box.set_xlabel(x_title)
    low, high = sorted(box.get_ylim())
    if low < 0 < high:
        box.axhline(0.0, color=LIGHT["rule"], linewidth=0.8, zorder=1)


def stack(panels: Sequence[Panel]) -> Draw:
    """Panels above each other with a shared x axis, labelled only at the bottom, under a common legend."""

    def draw(width_in: float) -> Picture:
        heights = [panel.height_in for panel in panels]
        picture = Picture(figsize=(width_in, sum(heights) + 0.3))
        boxes = picture.subplots(len(panels), 1, sharex=True, squeeze=False, height_ratios=heights)[:, 0]
        for panel, box in zip(panels, boxes, strict=True):
            panel.draw(box)
            box.label_outer()
        picture.align_ylabels()
        _legend(picture)
        return picture

    return draw


def side_by_side(panels: Sequence[Panel], columns: int = 3) -> Draw:
    """Panels in `columns` columns, or below each other if the page is narrow, under a common legend."""

    def draw(width_in: float) -> Picture:
        across = 1 if width_in < NARROW_IN else min(columns, len(panels))
        down = -(-len(panels) // across)
        heights = [max(p.height_in for p in panels[row * across : (row + 1) * across]) for row in range(down)]
        picture = Picture(figsize=(width_in, sum(heights) + 0.2))
        boxes = picture.subplots(down, across, squeeze=False, height_ratios=heights).ravel()
        for place, (panel, box) in enumerate(zip(panels, boxes[: len(panels)], strict=True)):
            panel.draw(box)
            # A panel lower than its row stays at the top of it.
            bottom, top = box.get_ylim()
            box.set_ylim(top + (bottom - top) * heights[place // across] / panel.height_in, top)
        for box in boxes[len(panels) :]:
            box.remove()
        _legend(picture)
        return picture

    return draw


def _legend(picture: Picture) -> None:
    """A legend above all boxes with an entry for each distinct label; none without labels."""
    entries: dict[str, Any] = {}
    for box in picture.axes:
        for handle, word in zip(*box.get_legend_handles_labels(), strict=True):
            entries.setdefault(word, handle)
    if not entries:
        return
    widest_in = LEGEND_IN + LETTER_IN * max(map(len, entries))
    columns = max(1, min(len(entries), int(picture.get_figwidth() / widest_in)))
    picture.legend(
        [entries[word] for word in entries], list(entries), loc="outside upper left", ncols=columns
    )
