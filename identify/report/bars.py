"""Bars that read like a table: a name, a bar, a number."""

from collections.abc import Sequence
from dataclasses import dataclass
from textwrap import wrap
from typing import TYPE_CHECKING

from identify.report.plot import Panel
from identify.report.theme import LIGHT

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
