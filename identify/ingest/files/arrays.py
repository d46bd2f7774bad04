"""Makes streams of named arrays, as NumPy (`.npz`) and MATLAB (`.mat`) keep them."""

import zipfile
import zlib
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from bridge.arrays import Array
from bridge.errors import LogError
from identify.ingest.files.streams import LONGEST_LIST, Stream, Streams, as_numbers, some_of

FEWEST_ROWS = 2
WIDEST, ROWS_A_COLUMN = 64, 10
"""Most columns of an array that holds a whole run, as simulators save it, and the least rows for each of them: with
fewer, it is an image or a matrix."""

Tree = Mapping[str, Any]
"""Arrays by name, and further trees: the fields of a struct."""
Path_ = tuple[str, ...]
Leaves = dict[Path_, Array]


def read_npz(path: Path) -> Streams:
    """The arrays of a `.npz`. Raises LogError."""
    try:
        with path.open("rb") as opened:
            file = np.load(opened, allow_pickle=False)
            if isinstance(file, np.ndarray):
                raise LogError("holds a single array without a name; save it with numpy.savez", path)
            held = {name: _loaded(file, name) for name in file.files}
    except OSError as error:
        raise LogError(f"can't be read ({error.strerror}); give a recording that can", path) from None
    except (ValueError, EOFError, zipfile.BadZipFile, zlib.error):
        raise LogError("is cut off or no .npz; save it again", path) from None
    return streams_of(held, path)


def _loaded(file: Any, name: str) -> Any:
    """An array of a `.npz`; None if it holds objects of Python, which are never loaded: they may run any program."""
    try:
        return file[name]
    except ValueError as error:
        if "allow_pickle" in str(error):
            return None
        raise


def streams_of(tree: Tree, path: Path, more: Sequence[Stream] = (), unread: Sequence[str] = ()) -> Streams:
    """Streams of arrays (n,), (n, k) or (k, n), k up to 16, or 64 of a long one, whose longer side is time.

    If all are of one length, they are the columns of a single table, named by the struct that holds all of them, if one
    does. Otherwise each struct whose arrays have one length
    is a stream with the struct's name, and arrays of the same length in the same struct are a stream `NAME.length100`.
    The k columns of an array are `NAME.0`, `NAME.1` and so on. Numbers that stand alone are left out. `more`: streams
    that were read otherwise. `unread`: names of further variables that were left out. Raises LogError if there are no
    arrays of numbers.
    """
    left_out: list[str] = []
    leaves = dict(_leaves(tree, (), left_out))
    if not leaves and not more:
        raise LogError("holds no arrays of numbers over time; save each signal as an array", path)
    left_out += unread
    notes = (
        (f"Not read, as they are no arrays of numbers over time: {some_of(left_out)}.",) if left_out else ()
    )
    return Streams((*(_streams((), leaves) if leaves else ()), *more), notes)


def _streams(at: Path_, leaves: Leaves) -> Iterator[Stream]:
    """Streams of all arrays below the struct `at`."""
    lengths = {len(values) for values in leaves.values()}
    if len(lengths) == 1:
        while len({name[len(at)] for name in leaves}) == 1 and min(map(len, leaves)) > len(at) + 1:
            at = (*at, next(iter(leaves))[len(at)])
        yield stream_of(".".join(at), {name[len(at) :]: values for name, values in leaves.items()})
        return
    here = {name: values for name, values in leaves.items() if len(name) == len(at) + 1}
    for length in sorted({len(values) for values in here.values()}, reverse=True):
        alike = {name: values for name, values in here.items() if len(values) == length}
        yield stream_of(
            ".".join((*at, f"length{length}")), {name[len(at) :]: values for name, values in alike.items()}
        )
    for inner in dict.fromkeys(name[len(at)] for name in leaves if name not in here):
        below = {n: v for n, v in leaves.items() if n not in here and n[len(at)] == inner}
        yield from _streams((*at, inner), below)


def stream_of(name: str, leaves: Leaves) -> Stream:
    """A stream of arrays (n,) or (n, k) by their places in it."""
    columns = {}
    for place, values in leaves.items():
        column = ".".join(place)
        if values.ndim == 1 or values.shape[1] == 1:
            columns[column] = values.ravel()
        else:
            columns |= {f"{column}.{k}": values[:, k] for k in range(values.shape[1])}
    return Stream(name, columns, {})


def _leaves(tree: Tree, at: Path_, left_out: list[str]) -> Iterator[tuple[Path_, Array]]:
    """Arrays over time, (n,) or (n, k), with their places; the names of others go to `left_out`."""
    for name, value in tree.items():
        place = (*at, str(name))
        if isinstance(value, Mapping):
            yield from _leaves(value, place, left_out)
        elif _is_list_of_structs(value):
            yield from _leaves({str(k): part for k, part in enumerate(value)}, place, left_out)
        else:
            array = np.squeeze(np.asarray(value)) if isinstance(value, np.ndarray) else None
            if array is not None and array.ndim == 0 and array.dtype.kind != "O":
                continue
            numbers = None if array is None else _over_time(array)
            if numbers is not None:
                yield place, numbers
            elif isinstance(value, np.ndarray) or value is None:
                left_out.append(".".join(place))


def _is_list_of_structs(value: object) -> bool:
    if isinstance(value, np.ndarray) and value.dtype.kind == "O":
        value = value.ravel().tolist()
    return isinstance(value, list) and bool(value) and all(isinstance(part, Mapping) for part in value)


def _over_time(array: Any) -> Array | None:
    if array.ndim == 2 and array.shape[0] < array.shape[1]:
        array = array.T
    if array.ndim not in (1, 2) or len(array) < FEWEST_ROWS:
        return None
    width = array.shape[1] if array.ndim == 2 else 1
    if width > LONGEST_LIST and (width > WIDEST or len(array) < ROWS_A_COLUMN * width):
        return None
    return as_numbers(array)
