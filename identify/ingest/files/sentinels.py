"""Numbers that stand for no reading, as sensors write them: 8888, -32768, 99.99."""

import re
from collections.abc import Set
from dataclasses import replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from bridge.arrays import Array
from identify.ingest.files.streams import Streams, some_of
from identify.words import listed

_SENTINEL: Final = re.compile(r"8{4,6}|9{4,6}|32768|32767|65535")
"""Their digits, without the decimal point."""
MOST_BESIDE: Final = 0.5
"""Nothing else in the column is larger than this part of the number."""
FEWEST: Final = 2
"""A number that comes once may be a reading."""


def without_sentinels(recorded: Streams, names: Set[str] | None = None) -> Streams:
    """The streams with NaN for the numbers that stand for no reading, and a note on these.

    They are numbers of certain digits that come several times and that nothing else in their column comes near.
    names: the columns that are looked at; None for all.
    """
    streams, columns_by_sentinel = [], dict[str, list[str]]()
    for stream in recorded.streams:
        columns = dict(stream.columns)
        for field, cells in stream.columns.items():
            name = stream.full_name(field)
            if (names is None or name in names) and (said := _sentinels(cells)).any():
                values = listed([f"{value:.7g}" for value in np.unique(cells[said])])
                columns_by_sentinel.setdefault(values, []).append(name)
                columns[field] = np.where(said, np.nan, cells)
        streams.append(replace(stream, columns=columns))
    if not columns_by_sentinel:
        return recorded
    notes = [
        f"{values} in {some_of(fields)}: taken for no reading."
        for values, fields in columns_by_sentinel.items()
    ]
    return replace(recorded, streams=tuple(streams), notes=(*recorded.notes, *notes))


def _sentinels(cells: Array) -> NDArray[np.bool_]:
    """Which cells (n,) of a column stand for no reading."""
    sizes = np.abs(np.where(np.isfinite(cells), cells, 0.0))
    said, least = np.zeros(len(cells), np.bool_), np.inf
    while (largest := float(sizes.max(initial=0.0))) and _SENTINEL.fullmatch(_digits(largest)):
        # A float of four bytes, as topics hold, is off by some 1e-7.
        of_it = np.isclose(sizes, largest, rtol=1e-6, atol=0.0)
        if np.count_nonzero(of_it) < FEWEST:
            break
        said |= of_it
        sizes, least = np.where(of_it, 0.0, sizes), largest
    return said if sizes.max(initial=0.0) <= MOST_BESIDE * least else np.zeros(len(cells), np.bool_)


def _digits(size: float) -> str:
    return f"{size:.6g}".replace(".", "").lstrip("0")
