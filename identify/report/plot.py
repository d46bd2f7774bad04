"""Plots with matplotlib in the page's colours: curves, bars, maps of shares, grouped bars.

A draw function takes a width: that of the page, or of a column. Only matplotlib's objects are used, never its global
state; `picture` sets the style while they are drawn. Dark ink on white and large type suit the sun, a dark scheme the
night. The colours of lines are distinct for readers who see no red, no green or no blue, and keep a contrast of about 5
to 1 to their background; each line nevertheless has a style or a shape as well.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from textwrap import wrap
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.colors import ListedColormap
from matplotlib.figure import Figure as Picture

from bridge.arrays import Array

if TYPE_CHECKING:
    from matplotlib.axes import Axes

LIGHT = {
    "ink": "#111111", "soft": "#444444", "ground": "#ffffff", "raised": "#f1f4f7", "tick": "#c9d0d6", "rule": "#5a646d",
    "first": "#0a4fa3", "second": "#c04600", "third": "#1a1a1a", "fourth": "#007d67",
    "reference": "#a0257f",
    "alarm": "#a30b0b", "alarm-ground": "#fdecea",
    "heat0": "#fbfcfd", "heat1": "#e3edf7", "heat2": "#bcd3ea", "heat3": "#8fb4dc",
    "heat4": "#2a66ad", "heat5": "#0a4a94",
}  # fmt: skip
"""By name. All differ, because `picture` finds the name of a colour in the drawn SVG."""

DARK = {
    "ink": "#f2f2f2", "soft": "#c4c9ce", "ground": "#101418", "raised": "#1c2329", "tick": "#353e46", "rule": "#8b959e",
    "first": "#6db8ff", "second": "#ff9a4d", "third": "#f4f4f4", "fourth": "#2fc7a4",
    "reference": "#e58fd0",
    "alarm": "#ffa198", "alarm-ground": "#3a1513",
    "heat0": "#12171b", "heat1": "#172a3c", "heat2": "#1d3f5e", "heat3": "#255780",
    "heat4": "#5ea6e8", "heat5": "#9dd0ff",
}  # fmt: skip


Draw = Callable[[float], Picture]
"""Draws a figure at a width in inches."""

STYLES: tuple[dict[str, Any], ...] = (
    {"color": LIGHT["first"], "linestyle": "-", "linewidth": 1.4},
    {"color": LIGHT["second"], "linestyle": (0, (5, 2)), "linewidth": 1.6},
    {"color": LIGHT["third"], "linestyle": (0, (1, 1.5)), "linewidth": 1.9},
    {"color": LIGHT["fourth"], "linestyle": (0, (7, 1.5, 1.5, 1.5)), "linewidth": 1.7},
    {"color": LIGHT["reference"], "linestyle": (0, (3, 1.5)), "linewidth": 1.7},
)
"""Each style has its own colour and dash, so that lines are distinct without colour; the last is the reference's."""

REFERENCE = len(STYLES) - 1

DISC: dict[str, Any] = {"marker": "o", "color": LIGHT["ink"], "linestyle": "", "zorder": 3}
DIAMOND: dict[str, Any] = {
    "marker": "D", "color": LIGHT["second"], "linestyle": "", "markerfacecolor": LIGHT["ground"],
    "markeredgewidth": 1.5, "zorder": 3,
}  # fmt: skip
SQUARE: dict[str, Any] = {"marker": "s", "color": LIGHT["ink"], "linestyle": "", "zorder": 3}

NARROW_IN = 6.0
LEGEND_IN, LEGEND_LETTER_IN = 0.55, 0.085
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
    widest_in = LEGEND_IN + LEGEND_LETTER_IN * max(map(len, entries))
    columns = max(1, min(len(entries), int(picture.get_figwidth() / widest_in)))
    picture.legend(
        [entries[word] for word in entries], list(entries), loc="outside upper left", ncols=columns
    )


ROOM, NAMES_ROOM = 1.3, 1.0
"""Width of the box in lengths of the longest bar: its number stands behind it, short names before it."""

SHORT_NAME, TWO_LINES, LETTER_IN = 20, 45, 0.075
"""SHORT_NAME: letters up to which names stand before their bars; all names stand above the bars if one is longer.
TWO_LINES: letters from which a name may take two lines. LETTER_IN: width of a letter.
"""


@dataclass(frozen=True)
class Bar:
    """A row. share: of the longest bar, 0 to 1, values below 0 count as 0. number: its figure with the unit.

    mark: a word for a selected bar, which is filled; other bars are light.
    """

    name: str
    share: float
    number: str
    mark: str = ""


def bars(rows: Sequence[Bar], title: str = "") -> Panel:
    """Draw the bars, the first at the top; names take at most two lines."""
    names = [f"{row.name}: {row.mark}" if row.mark else row.name for row in rows]
    longest = max(map(len, names), default=0)
    above = longest > SHORT_NAME
    left = 0.0 if above else -NAMES_ROOM
    widths = [min(max(row.share, 0.0), 1.0) for row in rows]
    fills = [LIGHT["first" if row.mark else "heat1"] for row in rows]

    def draw(box: "Axes") -> None:
        letters = int(box.figure.get_figwidth() / LETTER_IN)
        outline = {"edgecolor": LIGHT["first"], "linewidth": 1.2}
        box.barh(range(len(rows)), widths, height=0.3 if above else 0.6, color=fills, **outline)
        for place, (row, name, width) in enumerate(zip(rows, names, widths, strict=True)):
            weight = "bold" if row.mark else "normal"
            name_lines = "\n".join(wrap(name, letters, max_lines=2, placeholder=" …"))
            box.text(left, place - 0.2 * above, name_lines, va="bottom" if above else "center", weight=weight)
            box.text(width + 0.015, place, row.number, va="center", weight=weight)
        box.set_xlim(left, ROOM)
        box.set_ylim(len(rows) - 0.5, -0.85 if above else -0.5)
        box.set_title(title, loc="left")
        box.set_axis_off()

    row_in = 0.62 if longest > TWO_LINES else 0.46 if above else 0.25
    return Panel(draw, row_in * len(rows) + (0.4 if title else 0.2))


EDGES = (0.02, 0.15, 0.35, 0.6, 0.85)
"""Lower edges of the five shades, as shares of the largest cell."""

ROW_IN = 0.38


def heatmap(rows: Sequence[str], columns: Sequence[str], shares: Array) -> Panel:
    """Draw shares (rows, columns), the largest the darkest."""
    largest = float(shares.max(initial=0.0)) or 1.0
    shades = np.searchsorted(EDGES, shares / largest, side="right")
    down, across = shares.shape

    def draw(box: "Axes") -> None:
        palette = ListedColormap([LIGHT[f"heat{shade}"] for shade in range(len(EDGES) + 1)])
        edges = {"edgecolors": LIGHT["ground"], "linewidth": 2.0}
        box.pcolormesh(shades, cmap=palette, vmin=-0.5, vmax=len(EDGES) + 0.5, **edges)
        box.set_xlim(0, across)
        box.set_ylim(down, 0)
        box.set_xticks(np.arange(across) + 0.5, columns)
        box.set_yticks(np.arange(down) + 0.5, rows)
        box.tick_params(length=0, top=False, bottom=False, labeltop=True, labelbottom=False)
        box.grid(visible=False)
        for spine in box.spines.values():
            spine.set_visible(False)

    return Panel(draw, ROW_IN * down + 0.3)


WIDTH = 0.8
HATCHES = ("", "//", "\\\\", "xx")
"""A hatch for each colour, so that bars are distinct without colour."""


@dataclass(frozen=True)
class Group:
    """Bars of a colour: its word in the legend, and a value for each group; NaN leaves a gap."""

    label: str
    values: tuple[float, ...]


def grouped(title: str, names: Sequence[str], bars: Sequence[Group]) -> Panel:
    """Bars side by side above each name, from zero."""
    thick = WIDTH / max(len(bars), 1)

    def draw(box: "Axes") -> None:
        for k, group in enumerate(bars):
            places = np.arange(len(names)) + (k - (len(bars) - 1) / 2) * thick
            colour = STYLES[k % REFERENCE]["color"]
            hatch = HATCHES[k % len(HATCHES)]
            fill = colour if not hatch else LIGHT["ground"]
            box.bar(
                places,
                group.values,
                thick,
                label=group.label,
                color=fill,
                edgecolor=colour,
                hatch=hatch,
                linewidth=1.2,
            )
        box.set_ylim(bottom=0.0)
        box.set_xlim(-0.6, len(names) - 0.4)
        box.set_xticks(range(len(names)), [name.replace(" ", "\n") for name in names])
        box.grid(visible=False, axis="x")
        entitle(box, title, "")

    return Panel(draw, 2.2)
