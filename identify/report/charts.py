"""Bars that read like a table: a name, a bar, a number.

Map of shares: the darker a cell, the larger its share; each shows its number, so that no shade must be read.

Grouped bars: a group for each phase, with a bar for each mode.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from textwrap import wrap
from typing import TYPE_CHECKING

from identify.report.plot import LIGHT, Panel

if TYPE_CHECKING:
    from matplotlib.axes import Axes
from typing import TYPE_CHECKING

import numpy as np

from identify.dive import Array
from identify.words import fixed

if TYPE_CHECKING:
    from matplotlib.axes import Axes
from typing import TYPE_CHECKING

from identify.report.plot import STYLES, entitle

if TYPE_CHECKING:
    from matplotlib.axes import Axes

ROOM, NAMES_ROOM = 1.3, 1.0
"""Width of the box in lengths of the longest bar: its number stands behind it, short names before it."""

SHORT_NAME, TWO_LINES, LETTER_IN = 20, 45, 0.075
"""SHORT_NAME: letters up to which names stand before their bars; all names stand above the bars if one is longer.
TWO_LINES: letters from which a name may take two lines. LETTER_IN: width of a letter.
"""


@dataclass(frozen=True)
class Bar:
    """A row. share: of the longest bar, 0 to 1, values below 0 count as 0. told: number with its unit. mark: a word
    for a selected bar, which is filled; other bars are light.
    """

    name: str
    share: float
    told: str
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
            box.text(width + 0.015, place, row.told, va="center", weight=weight)
        box.set_xlim(left, ROOM)
        box.set_ylim(len(rows) - 0.5, -0.85 if above else -0.5)
        box.set_title(title, loc="left")
        box.set_axis_off()

    row_in = 0.62 if longest > TWO_LINES else 0.46 if above else 0.25
    return Panel(draw, row_in * len(rows) + (0.4 if title else 0.2))


EDGES = (0.02, 0.15, 0.35, 0.6, 0.85)
"""Lower edges of the five shades, as shares of the largest cell."""

DARK_SHADE = 4
"""From this shade on, a cell's number has the page's background colour."""

UNTOLD = 0.005
ROW_IN = 0.38


def heatmap(rows: Sequence[str], columns: Sequence[str], shares: Array) -> Panel:
    """Draw shares (rows, columns) in per cent, with the sums of both; a share under half a per cent has no number."""
    largest = float(shares.max(initial=0.0)) or 1.0
    shades = np.searchsorted(EDGES, shares / largest, side="right")
    down, across = shares.shape

    def draw(box: "Axes") -> None:
        from matplotlib.colors import ListedColormap

        palette = ListedColormap([LIGHT[f"heat{shade}"] for shade in range(len(EDGES) + 1)])
        edges = {"edgecolors": LIGHT["ground"], "linewidth": 2.0}
        box.pcolormesh(shades, cmap=palette, vmin=-0.5, vmax=len(EDGES) + 0.5, **edges)
        for (row, column), share in np.ndenumerate(shares):
            colour = LIGHT["ground" if shades[row, column] >= DARK_SHADE else "ink"]
            _tell(box, column, row, float(share), colour, "bold")
        for row, whole in enumerate(shares.sum(axis=1).tolist()):
            _tell(box, across, row, whole, LIGHT["soft"], "normal")
        for column, whole in enumerate((*shares.sum(axis=0).tolist(), float(shares.sum()))):
            _tell(box, column, down, whole, LIGHT["soft"], "normal")
        box.set_xlim(0, across + 1)
        box.set_ylim(down + 1, 0)
        box.set_xticks(np.arange(across + 1) + 0.5, [*columns, "all"])
        box.set_yticks(np.arange(down + 1) + 0.5, [*rows, "all"])
        box.tick_params(length=0, top=False, bottom=False, labeltop=True, labelbottom=False)
        box.grid(visible=False)
        for spine in box.spines.values():
            spine.set_visible(False)

    return Panel(draw, ROW_IN * (down + 1) + 0.3)


def _tell(box: "Axes", column: int, row: int, share: float, colour: str, weight: str) -> None:
    if share >= UNTOLD:
        percentage = fixed(100 * share, 0)
        box.text(column + 0.5, row + 0.5, percentage, ha="center", va="center", color=colour, weight=weight)


WIDTH = 0.8
HATCHES = ("", "//", "\\\\", "xx")
"""A hatch for each colour, so that bars are distinct without colour."""


@dataclass(frozen=True)
class Group:
    """Bars of a colour: its word in the legend, and a value for each group; NaN leaves a gap."""

    label: str
    values: tuple[float, ...]


def grouped(title: str, names: Sequence[str], bars: Sequence[Group], height_in: float = 2.2) -> Panel:
    """Bars side by side above each name, from zero."""
    thick = WIDTH / max(len(bars), 1)

    def draw(box: "Axes") -> None:
        for k, group in enumerate(bars):
            places = np.arange(len(names)) + (k - (len(bars) - 1) / 2) * thick
            colour = STYLES[k % len(STYLES)]["color"]
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

    return Panel(draw, height_in)
