"""Profile of each column of a file: range, rate, share unknown, and its course."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from bridge.arrays import Array
from bridge.errors import LogError
from identify.dive import Signal
from identify.ingest.files.streams import Stream
from identify.ingest.mapping.column_map import ColumnMap
from identify.ingest.mapping.signals import clock_of

PIECES = 12
"""Means that draw the course of a column."""


@dataclass(frozen=True)
class Profile:
    """A column: samples known, their rate, least, median, largest (NaN without any), share of rows unknown, mean over
    each of PIECES pieces of the file, and whether it holds words."""

    name: str
    samples: int
    rate_hz: float
    least: float
    median: float
    largest: float
    unknown: float
    course: tuple[float, ...] = ()
    is_text: bool = False


def profiles(streams: Sequence[Stream], columns: ColumnMap) -> tuple[Profile, ...]:
    """A profile of every column, in the file's order; rates by the map's time."""
    return tuple(
        profile
        for stream in streams
        for profile in (
            *(_numbers(stream, field, columns) for field in stream.columns),
            *(_words(stream, field) for field in stream.text),
        )
    )


def _numbers(stream: Stream, field: str, columns: ColumnMap) -> Profile:
    cells = stream.columns[field]
    known = cells[np.isfinite(cells)]
    name, unknown = stream.full_name(field), 1.0 - len(known) / max(len(cells), 1)
    if not len(known):
        return Profile(name, 0, 0.0, np.nan, np.nan, np.nan, unknown)
    ends = float(known.min()), float(np.median(known)), float(known.max())
    return Profile(name, len(known), _rate_hz(stream, cells, columns), *ends, unknown, _course(known))


def _words(stream: Stream, field: str) -> Profile:
    words = stream.text[field]
    known = sum(bool(word.strip()) for word in words)
    unknown = 1.0 - known / max(len(words), 1)
    return Profile(stream.full_name(field), known, 0.0, np.nan, np.nan, np.nan, unknown, is_text=True)


def _rate_hz(stream: Stream, cells: Array, columns: ColumnMap) -> float:
    """Rate of the known samples; 0 if the map's time is none here."""
    try:
        time_s = clock_of(stream, columns.time, Path(stream.name), {}).time_s
    except LogError:
        return 0.0
    known_s = np.unique(time_s[np.isfinite(cells) & np.isfinite(time_s)])
    return Signal(known_s, known_s[:, None]).counted_hz


def _course(known: Array) -> tuple[float, ...]:
    return tuple(float(np.mean(piece)) for piece in np.array_split(known, min(PIECES, len(known))))
