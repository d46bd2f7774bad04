"""A recording as streams of named numbers, the form in which every foreign file is read before a column map."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from bridge.arrays import Array, Mask

LONGEST_LIST = 16
"""A field with more numbers than this a row is an image, a map or a covariance, and is not read as columns."""
MOST_NAMED = 10


@dataclass(frozen=True)
class Stream:
    """Samples of one topic of a recording, or all rows of a table.

    name: of the topic; empty for a file that holds a single table. columns: by name, (n,) each, in the file's own
    units; NaN where a row has no value. Times are columns as well. `text`: columns (n,) of words, which no signal can
    be made of, except times. dates: the columns that a Parquet itself holds as dates, or as spans of time, and not as
    numbers; they are in s, whatever unit their names end in.

    A column map names a column by topic and field, as `/dvl/data.velocity.x`, or by the field alone in a single table.
    """

    name: str
    columns: dict[str, Array]
    text: dict[str, tuple[str, ...]]
    dates: frozenset[str] = frozenset()

    def full_name(self, column: str) -> str:
        """The name that a column map uses."""
        return f"{self.name}.{column}" if self.name else column


@dataclass(frozen=True)
class Streams:
    """The content of a foreign file, and notes on what was left out.

    empty: of tables, by a column's full name, (n,), the rows without a cell there. Such a row has no sample; a row with
    a NaN has a sample of unknown value. lines (n,): of a table of text, the number of each row's line in
    the file, from 1.
    """

    streams: tuple[Stream, ...]
    notes: tuple[str, ...] = ()
    empty: Mapping[str, Mask] = field(default_factory=dict)
    lines: NDArray[np.intp] | None = None


def as_numbers(values: NDArray[np.generic]) -> Array | None:
    """An array as float64, dates in Unix s, spans of time in s; None if it holds no numbers."""
    if values.dtype.kind in "biuf":
        return values.astype(np.float64)
    if values.dtype.kind in "mM":
        seconds = values.astype(f"{values.dtype.kind}8[ns]").astype(np.int64) * 1e-9
        return np.where(np.isnat(values), np.nan, seconds)
    return None


def some_of(names: Sequence[str]) -> str:
    """At most ten names, and the number of those left unsaid: `a, b and 7 more`."""
    more = len(names) - MOST_NAMED
    return ", ".join(names[:MOST_NAMED]) + (f" and {more} more" if more > 0 else "")
