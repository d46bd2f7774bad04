"""A map of shares: cells the darker the larger, each with its number, so that no shade has to be read."""

from collections.abc import Sequence

import numpy as np

from identify.dive import Array
from identify.report.text import fixed, safe

EDGES = (0.02, 0.15, 0.35, 0.6, 0.85)
"""Of the largest cell: where each of the five shades begins."""

UNTOLD = 0.005


def heatmap(rows: Sequence[str], columns: Sequence[str], shares: Array) -> str:
    """Shares (rows, columns) in per cent, with the sums of both, as one `<table>`; a share under half a per cent has
    no number."""
    largest = float(shares.max(initial=0.0))
    head = "".join(f'<th scope="col">{safe(name)}</th>' for name in (*columns, "all"))
    body = "".join(
        f'<tr><th scope="row">{safe(name)}</th>{"".join(_cell(v, largest) for v in line.tolist())}'
        f'<td class="sum">{_told(float(line.sum()))}</td></tr>'
        for name, line in zip(rows, shares, strict=True)
    )
    foot = "".join(
        f'<td class="sum">{_told(v)}</td>' for v in (*shares.sum(axis=0).tolist(), float(shares.sum()))
    )
    return (
        f'<table class="heat"><thead><tr><td></td>{head}</tr></thead><tbody>{body}'
        f'<tr><th scope="row">all</th>{foot}</tr></tbody></table>'
    )


def _cell(share: float, largest: float) -> str:
    shade = int(np.searchsorted(EDGES, share / largest, side="right")) if largest > 0 else 0
    return f'<td class="heat{shade}">{_told(share)}</td>'


def _told(share: float) -> str:
    return fixed(100 * share, 0) if share >= UNTOLD else ""
