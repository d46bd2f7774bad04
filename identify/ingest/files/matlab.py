"""Reads MATLAB's `.mat`, of version 4 to 7.2 and of 7.3, which is HDF5, into streams.

MATLAB's own objects, tables, timetables and timeseries, are read by a library; each is a stream with its times.
"""

import warnings
import zlib
from collections.abc import Iterator, Mapping
from dataclasses import replace
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np

from bridge.arrays import Array
from bridge.errors import LogError
from identify.ingest.files.arrays import FEWEST_ROWS, Tree, stream_of, streams_of
from identify.ingest.files.optional_libraries import library
from identify.ingest.files.streams import Stream, Streams, as_numbers

EXTRA = "tables"
HDF5 = b"\x89HDF\r\n\x1a\n"
HDF5_AT = 512
"""MATLAB writes a text of its own before the HDF5 file."""
DEEPEST = 20
NO_NAME, WORKSPACE = "None", "__function_workspace__"
"""Variables under which SciPy gives an object, and the part of the file that describes all of them."""
OBJECT, SUBSYSTEM = "MATLAB_object_decode", "#subsystem#"
"""The same in HDF5: an attribute, and a group."""
OBJECTS = "objects of MATLAB, such as a table or a timeseries"
INSTALL = "install the library that reads them with pip install 'seatrial[matlab]'"
AS_STRUCTS = (
    "save them as structs in MATLAB: table2struct(T, 'ToScalar', true), or struct('t', ts.Time, 'x', ts.Data)"
)
_UNREADABLE = (
    ValueError,
    TypeError,
    KeyError,
    IndexError,
    EOFError,
    OSError,
    zlib.error,
    OverflowError,
    MemoryError,
)


def read_matlab(path: Path) -> Streams:
    """The arrays and structs of a `.mat` (see `arrays.streams_of`), and its tables, timetables and timeseries.

    These are objects, in a form of MATLAB's own: without the library that reads them, they are left out with a note.
    Raises LogError.
    """
    try:
        with path.open("rb") as file:
            lead = file.read(HDF5_AT + len(HDF5))
    except OSError as error:
        raise LogError(f"can't be read ({error.strerror}); give a recording that can", path) from None
    is_hdf5 = lead.startswith(HDF5) or lead[HDF5_AT:] == HDF5
    tree, has_objects = _from_hdf5(path) if is_hdf5 else _from_matlab(path)
    if not has_objects:
        return streams_of(tree, path)
    if not can_read_objects():
        return _without_objects(tree, path)
    try:
        objects, unread = read_objects(path)
    except Exception:  # noqa: BLE001 (MATLAB describes this form nowhere, and the library may fail anyhow)
        raise LogError(f"holds objects of MATLAB that can't be read; {AS_STRUCTS}", path) from None
    return streams_of(tree, path, objects, unread)


def _without_objects(tree: Tree, path: Path) -> Streams:
    """What a file holds besides its objects, with a note on these. Raises LogError if that is nothing."""
    try:
        held = streams_of(tree, path)
    except LogError:
        raise LogError(f"holds {OBJECTS}: {INSTALL}; or {AS_STRUCTS}", path) from None
    return replace(
        held, notes=(*held.notes, f"Not read: {OBJECTS}. {INSTALL[0].upper()}{INSTALL[1:]}; or {AS_STRUCTS}.")
    )


def _from_matlab(path: Path) -> tuple[Tree, bool]:
    """The variables, and whether the file has objects too, which are not read."""
    io = library("scipy.io", "ground", path)
    try:
        with path.open("rb") as file, warnings.catch_warnings():
            warnings.simplefilter("ignore", io.matlab.MatReadWarning)
            held = io.loadmat(file, simplify_cells=True)
    except (io.matlab.MatReadError, NotImplementedError, *_UNREADABLE):
        raise LogError("is cut off or no .mat; save it again in MATLAB", path) from None
    tree = {name: value for name, value in held.items() if not name.startswith("__") and name != NO_NAME}
    return tree, WORKSPACE in held or NO_NAME in held


def _from_hdf5(path: Path) -> tuple[Tree, bool]:
    """As `_from_matlab`."""
    h5py = library("h5py", EXTRA, path)

    def tree(group: Any, depth: int) -> Tree:
        return {
            name: value
            for name in group
            if not name.startswith("#") and (value := branch(group[name], depth)) is not None
        }

    def branch(item: Any, depth: int) -> Any:
        """A struct or an array; None for text and for references."""
        if isinstance(item, h5py.Group):
            return tree(item, depth + 1) if depth < DEEPEST else None
        if not isinstance(item, h5py.Dataset) or item.attrs.get("MATLAB_class", b"") == b"char":
            return None
        if OBJECT in item.attrs:
            return None
        # HDF5 holds MATLAB's arrays with their sides swapped, which `arrays` sees by the longer one.
        return np.asarray(item)

    try:
        with h5py.File(path, "r") as file:
            return tree(file, 0), SUBSYSTEM in file
    except (RuntimeError, *_UNREADABLE):
        raise LogError("is cut off or damaged; save it again in MATLAB", path) from None


OBJECTS_EXTRA = "matlab"
DEEPEST_OBJECT = 8
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
        matio = library("matio", OBJECTS_EXTRA, path)
        held = matio.load_from_mat(str(path))
    streams: list[Stream] = []
    left_out: list[str] = []
    for name, value in held.items():
        _walk(name, value, streams, left_out, 0)
    return streams, left_out


def _walk(name: str, value: Any, streams: list[Stream], left_out: list[str], depth: int) -> None:
    """Add the objects in a value; a struct and a cell are walked through, an array of numbers is no object."""
    if depth > DEEPEST_OBJECT:
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
    """A timeseries by its properties; None for any other object, or without samples."""
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
