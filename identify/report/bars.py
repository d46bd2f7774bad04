"""Bars in a table: a name, a bar, a number; they keep their text's size from a telephone to a wide screen."""

from collections.abc import Sequence
from dataclasses import dataclass

from identify.report.text import safe


@dataclass(frozen=True)
class Bar:
    """One row. share: of the longest bar, 0 to 1, none below 0; told: its number with the unit. Chosen ones are filled
    and say so in `mark`, the others are hollow."""

    name: str
    share: float
    told: str
    mark: str = ""


def bars(rows: Sequence[Bar], title: str = "") -> str:
    """The bars as one `<table>`."""
    head = f"<caption>{safe(title)}</caption>" if title else ""
    return f'<table class="bars">{head}<tbody>{"".join(map(_row, rows))}</tbody></table>'


def folded(summary: str, inner: str) -> str:
    """Markup that stands folded away under a line that says what it is."""
    return f"<details><summary>{safe(summary)}</summary>{inner}</details>"


def side_by_side(parts: Sequence[str]) -> str:
    """Markups in as many columns as the page has room for."""
    return f'<div class="grid bargrid">{"".join(f"<div>{part}</div>" for part in parts)}</div>'


def _row(bar: Bar) -> str:
    kind = "filled" if bar.mark else "hollow"
    wide = 100 * min(max(bar.share, 0.0), 1.0)
    drawn = f'<span class="{kind}bar" style="width:{wide:.1f}%"></span>' if wide > 0 else ""
    mark = f" <b>{safe(bar.mark)}</b>" if bar.mark else ""
    return (
        f'<tr><th scope="row">{safe(bar.name)}{mark}</th><td class="barroom">{drawn}</td>'
        f'<td class="number">{safe(bar.told)}</td></tr>'
    )
