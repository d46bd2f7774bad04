"""Reads MATLAB's own objects in a `.mat`, tables, timetables and timeseries, each a stream with its times."""

import warnings
from collections.abc import Iterator, Mapping
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np

from bridge.arrays import Array
from identify.ingest.arrays import FEWEST_ROWS, stream_of
from identify.ingest.extras import library
from identify.ingest.streams import Stream, as_numbers

EXTRA = "matlab"
DEEPEST = 8
TIME, DATA = "Time", "Data"
HELD_AS = {TIME: ("Time", "Time_"), DATA: ("Data", "Data_")}
"""Properties of a timeseries that may hold its times and values; evenly spaced times are told by START and STEP."""
START, STEP = "Start_", "Increment_"
TIME_INFO = ("TimeInfo", "TimeInfo_")


def can_read_objects() -> bool:
    """Whether the library that reads them is installed."""
    return find_spec("matio") is not None


def read_objects(path: Path) -> tuple[list[Stream], list[str]]:
    """Streams of all objects, also in structs and in objects, and the names of those that hold no samples.

    Raises LogError if the library is missing, and an error of any kind for a file that is damaged.
    """
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        matio = library("matio", EXTRA, path)
        held = matio.load_from_mat(str(path))
    streams: list[Stream] = []
    left_out: list[str] = []
    for name, value in held.items():
        _walk(name, value, streams, left_out, 0)
    return streams, left_out


def _walk(name: str, value: Any, streams: list[Stream], left_out: list[str], depth: int) -> None:
    """Add the objects in a value; a struct and a cell are walked through, an array of numbers is no object."""
    if depth > DEEPEST:
        return
    if hasattr(value, "iloc"):
        streams.append(_table(name, value))
    elif isinstance(properties := getattr(value, "properties", None), Mapping):
        series = _series(name, properties)
        if series is not None:
            streams.append(series)
            return
        before = len(streams)
        for part, inner in properties.items():
            _walk(f"{name}.{part}", inner, streams, left_out, depth + 1)
        if len(streams) == before and not depth:
            left_out.append(name)
    elif isinstance(value, np.ndarray):
        for part, inner in _parts(value):
            _walk(f"{name}{part}", inner, streams, left_out, depth + 1)


def _parts(array: Any) -> Iterator[tuple[str, Any]]:
    """The fields of structs and the cells of an array, with the ends of their names."""
    cells = array.ravel()
    for k, cell in enumerate(cells):
        number = f".{k}" if len(cells) > 1 else ""
        if array.dtype.names:
            yield from ((f"{number}.{field}", cell[field]) for field in array.dtype.names)
        elif array.dtype.kind == "O":
            yield number, cell


def _table(name: str, frame: Any) -> Stream:
    """The columns of a table; of a timetable, the times of its rows as well."""
    columns: dict[str, Any] = {}
    if frame.index.name is not None:
        columns[str(frame.index.name)] = frame.index.to_numpy()
    columns |= {str(column): frame[column].to_numpy() for column in frame.columns}
    numbers = {column: read for column, cells in columns.items() if (read := as_numbers(cells)) is not None}
    texts = {column: tuple(map(str, cells)) for column, cells in columns.items() if column not in numbers}
    return Stream(name, numbers, texts)


def _series(name: str, properties: Mapping[str, Any]) -> Stream | None:
    """A timeseries by its properties; None for another object, or for one without samples."""
    data = _first(properties, HELD_AS[DATA])
    if data is None:
        return None
    time = _first(properties, HELD_AS[TIME])
    info = next((properties[key] for key in TIME_INFO if key in properties), None)
    steps = getattr(info, "properties", None)
    rows = len(time) if time is not None else max(data.shape)
    # Simulink keeps time as the last side of an array, MATLAB as its first.
    side = next((side for side in (0, data.ndim - 1) if data.shape[side] == rows), None)
    if side is None:
        return None
    if time is None:
        if not isinstance(steps, Mapping) or not {START, STEP} <= steps.keys():
            return None
        start, step = (float(np.ravel(steps[key])[0]) for key in (START, STEP))
        time = start + step * np.arange(rows)
    return stream_of(name, {(TIME,): np.ravel(time), (DATA,): np.moveaxis(data, side, 0).reshape(rows, -1)})


def _first(properties: Mapping[str, Any], names: tuple[str, ...]) -> Array | None:
    """The first property of `names` that holds samples, without sides of length 1."""
    for name in names:
        value = properties.get(name)
        if isinstance(value, np.ndarray) and value.size >= FEWEST_ROWS and value.dtype.kind in "biuf":
            return np.squeeze(value).astype(np.float64)
    return None
