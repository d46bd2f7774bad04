"""Reads MATLAB's `.mat`, of version 4 to 7.2 and of 7.3, which is HDF5, into streams."""

import zlib
from pathlib import Path
from typing import Any

import numpy as np

from bridge.errors import LogError
from identify.ingest.arrays import Tree, streams_of
from identify.ingest.extras import library
from identify.ingest.streams import Streams

EXTRA = "tables"
HDF5 = b"\x89HDF\r\n\x1a\n"
HDF5_AT = 512
"""MATLAB writes a text of its own before the HDF5 file."""
DEEPEST = 20
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
    """The arrays and structs of a `.mat` (see `arrays.streams_of`). Raises LogError.

    Objects of MATLAB, such as a `timeseries` or a `table`, are in a form of its own and are left out.
    """
    try:
        with path.open("rb") as file:
            lead = file.read(HDF5_AT + len(HDF5))
    except OSError as error:
        raise LogError(f"can't be read ({error.strerror}); give a recording that can", path) from None
    is_hdf5 = lead.startswith(HDF5) or lead[HDF5_AT:] == HDF5
    return streams_of(_from_hdf5(path) if is_hdf5 else _from_matlab(path), path)


def _from_matlab(path: Path) -> Tree:
    io = library("scipy.io", "ground", path)
    try:
        with path.open("rb") as file:
            held = io.loadmat(file, simplify_cells=True)
    except (io.matlab.MatReadError, NotImplementedError, *_UNREADABLE):
        raise LogError("is cut off or no .mat; save it again in MATLAB", path) from None
    return {name: value for name, value in held.items() if not name.startswith("__")}


def _from_hdf5(path: Path) -> Tree:
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
        # HDF5 holds MATLAB's arrays with their sides swapped, which `arrays` sees by the longer one.
        return np.asarray(item)

    try:
        with h5py.File(path, "r") as file:
            return tree(file, 0)
    except (RuntimeError, *_UNREADABLE):
        raise LogError("is cut off or damaged; save it again in MATLAB", path) from None
