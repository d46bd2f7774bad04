"""Grouped bars: a group for each phase, with a bar for each mode."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from identify.report.plot import STYLES, Panel, entitle
from identify.report.theme import LIGHT

if TYPE_CHECKING:
    from matplotlib.axes import Axes

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
