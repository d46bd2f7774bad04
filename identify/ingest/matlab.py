"""Reads MATLAB's `.mat`, of version 4 to 7.2 and of 7.3, which is HDF5, into streams."""

import warnings
import zlib
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from bridge.errors import LogError
from identify.ingest.arrays import Tree, streams_of
from identify.ingest.extras import library
from identify.ingest.matlab_objects import can_read_objects, read_objects
from identify.ingest.streams import Streams

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
    """The variables, and whether there are objects, which are none of them."""
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
        """A struct or an array; None for words, and what MATLAB keeps by reference."""
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
