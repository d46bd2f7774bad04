"""A recording as streams of named numbers, the form in which every foreign file is read before a column map."""

import csv
import io
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from bridge.errors import LogError
from bridge.wire.tlog import load_bytes
from identify.dive import Array

Mask = NDArray[np.bool_]


@dataclass(frozen=True)
class Stream:
    """Samples of one topic of a recording, or all rows of a table.

    name: of the topic; empty for a file that holds a single table. columns: by name, (n,) each, in the file's own
    units; NaN where a row has no value. Times are columns as well. `text`: columns (n,) of words, which no signal can
    be made of, except times.

    A column map names a column by topic and field, as `/dvl/data.velocity.x`, or by the field alone in a single table.
    """

    name: str
    columns: dict[str, Array]
    text: dict[str, tuple[str, ...]]

    def full_name(self, column: str) -> str:
        """The name that a column map uses."""
        return f"{self.name}.{column}" if self.name else column


def streams_of(path: Path) -> tuple[tuple[Stream, ...], tuple[str, ...]]:
    """The streams of a recording that needs a column map, and notes on what was left out of it. Raises LogError."""
    if path.is_dir() or not path.name.lower().endswith(".csv"):
        raise LogError(f"{path}: needs no column map, or is none of the files that take it; give a .csv")
    header, cells, _, notes = cells_of(path)
    return (Stream("", dict(zip(header, cells.T, strict=True)), {}),), notes


def cells_of(path: Path) -> tuple[list[str], Array, Mask, tuple[str, ...]]:
    """Header, numbers (rows, columns) with NaN for empty cells, mask of empty cells, and notes on omitted rows."""
    data, _ = load_bytes(path)
    try:
        lines = list(csv.reader(io.StringIO(data.decode("utf-8-sig"))))
    except (UnicodeDecodeError, csv.Error):
        raise LogError(f"{path}: is no table of text; give a .csv with a line of names first") from None
    lines = [line for line in lines if line]
    if len(lines) < 2:
        raise LogError(f"{path}: holds no rows; give a .csv with a line of names and a line for each sample")
    header, body = [name.strip() for name in lines[0]], lines[1:]
    notes: tuple[str, ...] = ()
    if len(body[-1]) < len(header):
        body, notes = body[:-1], ("The last row is cut off and was left out.",)
    rows = []
    for number, line in enumerate(body, start=2):
        if len(line) != len(header):
            raise LogError(
                f"{path}: row {number} has {len(line)} cells, the first line names {len(header)}; mend it"
            )
        try:
            rows.append([float(cell) if cell.strip() else np.nan for cell in line])
        except ValueError:
            wrong = next(cell for cell in line if not _is_number(cell))
            raise LogError(f"{path}: row {number} holds '{wrong}', which is no number; mend it") from None
    shape = -1, len(header)
    empty = np.array([[not cell.strip() for cell in line] for line in body], np.bool_).reshape(shape)
    return header, np.array(rows, np.float64).reshape(shape), empty, notes


def _is_number(cell: str) -> bool:
    try:
        float(cell or "nan")
    except ValueError:
        return False
    return True
