"""Signals of a dive from streams and a column map, as far as they can be made: for a look at a file."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from identify.dive import Array, Dive, Signal
from identify.ingest import rotation
from identify.ingest.clock import of_day_s, within_seconds
from identify.ingest.column_map import NOTHING, OF_DAY, RADIANS_PER_RPM, TIME_UNITS, UNITS, ColumnMap, Columns
from identify.ingest.streams import Stream


def mapped(streams: Sequence[Stream], columns: ColumnMap, path: Path) -> Dive:
    """The signals that a column map makes of streams, in SI, body axes as the map has them.

    A signal whose columns or time are missing is left out; so are rows without a time, and rows of a time that was
    there already.
    """
    signals: dict[str, Any] = {
        name: signal
        for name, source in columns.signals().items()
        if (signal := _signal(streams, columns, name, source)) is not None
    }
    euler, quaternion = signals.pop("euler", None), signals.pop("quaternion", None)
    if quaternion is not None:
        signals["attitude"] = quaternion
    elif euler is not None:
        signals["attitude"] = Signal(euler.time_s, rotation.quaternions_from_euler(*euler.value.T))
    return Dive(path.name, path, "", velocity_is_filtered=columns.velocity_is_filtered, **signals)


def rows_of(stream: Stream, columns: ColumnMap) -> tuple[Array, NDArray[np.intp]] | None:
    """Rising times (n,) in s of a stream, and the rows (n,) that they are of; None without a numeric time."""
    cells = stream.columns.get(_field(stream, columns.time.column))
    if cells is None:
        return None
    if columns.time.unit == OF_DAY:
        seconds = of_day_s(cells)
        spread_s = within_seconds(seconds)
        time_s = seconds if spread_s is None else spread_s
    else:
        time_s = cells * TIME_UNITS[columns.time.unit]
    known = np.flatnonzero(np.isfinite(time_s))
    rows = known[np.argsort(time_s[known], kind="stable")]
    rows = rows[np.diff(time_s[rows], prepend=-np.inf) > 0]
    return time_s[rows], rows


def stream_of(streams: Sequence[Stream], source: Columns) -> Stream | None:
    """The stream that holds all columns of a signal."""
    names = {name for name in source.named if name is not None and name != NOTHING}
    return next((s for s in streams if names <= {s.full_name(field) for field in s.columns}), None)


def _signal(streams: Sequence[Stream], columns: ColumnMap, name: str, source: Columns) -> Signal | None:
    stream = stream_of(streams, source)
    timed = rows_of(stream, columns) if stream is not None else None
    if stream is None or timed is None:
        return None
    time_s, rows = timed
    cells = {stream.full_name(field): values[rows] for field, values in stream.columns.items()}
    names = [column for column in source.named if column is not None and column != NOTHING]
    sampled = np.any([np.isfinite(cells[column]) for column in names], axis=0)
    value = np.column_stack(
        [
            np.full(len(rows), np.nan) if column is None else cells.get(column, np.zeros(len(rows)))
            for column in source.named
        ]
    )[sampled]
    value = (value + np.array(source.offset or 0.0)) * np.array(source.scale or 1.0)
    factor = 1 / RADIANS_PER_RPM if (name, source.unit) == ("rpm", "rad/s") else UNITS[source.unit]
    return Signal(time_s[sampled], value * factor)


def _field(stream: Stream, column: str) -> str:
    """The field that a map's time names, which it may give with its topic."""
    return column.removeprefix(f"{stream.name}.") if stream.name else column
