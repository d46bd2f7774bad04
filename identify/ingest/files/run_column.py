"""Runs below each other in a table, separated by a column."""

import itertools
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from bridge.arrays import Array
from bridge.errors import LogError
from identify.ingest.files.streams import Stream, Streams, some_of
from identify.ingest.mapping.column_map import RunColumn
from identify.ingest.mapping.names import time_unit

MOST_RUNS = 2000
LEAP, OFTEN, MOST = 3.0, 0.99, 0.9
"""In MOST of the run starts the clock jumps by more than LEAP times the step that OFTEN of the rows stay below."""

FEWEST_ROWS = 10
"""Rows of a run, on average: a column with more values than that is a measurement."""


def split_streams(recorded: Streams, column: RunColumn, path: Path) -> list[tuple[str, Streams]]:
    """The rows of each run, named by the column's value, in order of their first rows.

    A row without a value is of no run. Raises LogError if the recording is no single table, or the column names no
    runs.
    """
    if len(recorded.streams) > 1:
        raise LogError(
            f"holds {len(recorded.streams)} topics, and `runs` of a column map is for a single table; leave it "
            "out, and give each run a file of its own",
            path,
        )
    stream = recorded.streams[0]
    if column.column not in (*stream.columns, *stream.text):
        known = some_of([*stream.columns, *stream.text])
        raise LogError(
            f"has no column '{column.column}' for the runs; it has {known}: mend the column map", path
        )
    words = labels(stream, column.column)
    names = _in_order(words)
    if not names or len(names) > MOST_RUNS or len(names) * FEWEST_ROWS > len(words):
        raise LogError(
            f"'{column.column}' has {len(names)} value{'' if len(names) == 1 else 's'} in {len(words)} "
            f"row{'' if len(words) == 1 else 's'}, so it names no runs; mend `runs` "
            "in the column map",
            path,
        )
    lost = int(np.count_nonzero(words == ""))
    rows, were = ("row", "was") if lost == 1 else ("rows", "were")
    notes = (f"{lost} {rows} without a run in '{column.column}' {were} left out.",) if lost else ()
    return [(name, _rows(recorded, np.flatnonzero(words == name), notes)) for name in names]


def labels(stream: Stream, column: str) -> NDArray[np.str_]:
    """The value (n,) of a column in each row, in words; "" for none."""
    if column in stream.text:
        return np.array([word.strip() for word in stream.text[column]], dtype=np.str_)
    cells = stream.columns[column]
    values, place = np.unique(cells, return_inverse=True)
    return np.array(["" if np.isnan(value) else f"{value:.15g}" for value in values], dtype=np.str_)[place]


def run_column_in(streams: Sequence[Stream]) -> str:
    """The column that names the runs of a single table: a clock falls back or leaps where it takes a new value, and
    never falls back elsewhere.

    Empty if there is none.
    """
    if len(streams) != 1:
        return ""
    (stream,) = streams
    clocks = [cells for field, cells in stream.columns.items() if time_unit(field)[0]]
    columns = [field for field in (*stream.columns, *stream.text) if not time_unit(field)[0]]
    for clock, column in itertools.product(clocks, columns):
        if (np.diff(clock) < 0).any() and _starts_anew(clock, stream, column):
            return column
    return ""


def split_table(stream: Stream, column: str) -> list[tuple[str, Stream]]:
    """The rows of each run of a table, with the run's name."""
    words = labels(stream, column)
    return [(name, _take(stream, np.flatnonzero(words == name))) for name in _in_order(words)]


def _in_order(words: NDArray[np.str_]) -> list[str]:
    """The names of the runs in a column (n,), in order of their first rows."""
    return list(dict.fromkeys(words[words != ""].tolist()))


def _starts_anew(clock: Array, stream: Stream, column: str) -> bool:
    """Whether a clock (n,) starts anew where a column takes a new value, and nowhere else."""
    if column in stream.columns and not _integral(stream.columns[column]):
        return False
    words, steps = labels(stream, column), np.diff(clock)
    changes = np.flatnonzero(words[1:] != words[:-1])
    inside = np.delete(steps, changes)
    if not len(changes) or len(np.unique(words)) != len(changes) + 1 or not len(inside) or (inside < 0).any():
        return False
    leaps = steps[changes] > LEAP * np.quantile(inside, OFTEN)
    return bool(np.mean(leaps | (steps[changes] < 0)) >= MOST)


def _integral(cells: Array) -> bool:
    known = cells[np.isfinite(cells)]
    return bool(len(known) and (known == np.rint(known)).all())


def _rows(recorded: Streams, rows: NDArray[np.intp], notes: tuple[str, ...]) -> Streams:
    return replace(
        recorded,
        streams=(_take(recorded.streams[0], rows),),
        notes=(*recorded.notes, *notes),
        empty={name: mask[rows] for name, mask in recorded.empty.items()},
        lines=None if recorded.lines is None else recorded.lines[rows],
    )


def _take(stream: Stream, rows: NDArray[np.intp]) -> Stream:
    return replace(
        stream,
        columns={name: cells[rows] for name, cells in stream.columns.items()},
        text={name: tuple(words[row] for row in rows) for name, words in stream.text.items()},
    )
