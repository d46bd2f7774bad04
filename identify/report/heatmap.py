"""Map of shares: the darker a cell, the larger its share; each shows its number, so that no shade must be read."""

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from identify.dive import Array
from identify.report.plot import Panel
from identify.report.text import fixed
from identify.report.theme import LIGHT

if TYPE_CHECKING:
    from matplotlib.axes import Axes

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
