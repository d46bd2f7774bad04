"""Reads JSON lines: an object a line, as the loggers of a DVL, a broker or a script write.

Objects of several kinds, told apart by a field such as `type` or `topic`, are a topic each.
"""

import json
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, Final

import numpy as np

from bridge.arrays import Mask
from bridge.errors import LogError
from bridge.wire.tlog import load_bytes
from identify.ingest.files.streams import LONGEST_LIST, Stream, Streams
from identify.words import listed

KINDS: Final = ("topic", "type", "msg_type", "message_type", "mavpackettype", "channel", "sensor")
"""Fields that name an object's kind, the most telling first."""
MOST_KINDS: Final = 64
MOST_BAD: Final = 1_000
"""At most one line in so many may be no object."""

Cells = dict[str, Any]
"""Numbers, words or None by the place in an object: `velocity.x`, `forces.0`."""


def read_json_lines(path: Path) -> Streams:
    """The objects of a file, a row each; a field that an object lacks is an empty cell. Raises LogError."""
    data, complete = load_bytes(path)
    lines = data.decode("utf-8-sig", errors="replace").splitlines()
    rows: list[Cells] = []
    bad: list[int] = []
    notes: list[str] = []
    for number, line in enumerate(lines, start=1):
        if not line.strip():
            continue
        try:
            rows.append(dict(_cells(json.loads(line), "")))
        except (ValueError, RecursionError, OverflowError):
            bad.append(number)
    if bad and bad[-1] == len(lines) and (not complete or not data.endswith(b"\n")):
        bad.pop()
        notes.append("The last line is cut off and was left out.")
    if len(bad) * MOST_BAD > max(len(rows), MOST_BAD):
        raise LogError(f"line {bad[0]} is no JSON object; give a file with an object in each line", path)
    if bad:
        notes.append(f"Line {listed([str(number) for number in bad])} is no JSON object and was left out.")
    if not rows:
        raise LogError("holds no JSON objects; give a file with an object in each line", path)
    streams, empty = list[Stream](), dict[str, Mask]()
    for name, of_kind in _by_kind(rows).items():
        stream, blank = _stream(name, of_kind)
        if stream.columns:
            streams.append(stream)
            empty |= {stream.full_name(column): mask for column, mask in blank.items()}
    return Streams(tuple(streams), tuple(notes), empty)


def _cells(value: Any, at: str) -> Iterator[tuple[str, Any]]:
    """The numbers and words of an object by their places, without lists of objects, of lists or of more than
    LONGEST_LIST. Raises ValueError for anything but an object, OverflowError for a number that is none."""
    if isinstance(value, Mapping):
        for name, inner in value.items():
            yield from _cells(inner, f"{at}.{name}" if at else str(name))
    elif not at:
        raise ValueError
    elif isinstance(value, list):
        plain = not any(isinstance(inner, Mapping | list) for inner in value)
        if plain and len(value) <= LONGEST_LIST:
            yield from ((f"{at}.{k}", inner) for k, inner in enumerate(value))
    else:
        yield at, value if value is None or isinstance(value, str) else float(value)


def _by_kind(rows: Sequence[Cells]) -> dict[str, list[Cells]]:
    """The rows by their kind; all under "" if no field tells kinds apart."""
    for field in KINDS:
        kinds = {row.get(field) for row in rows}
        if 1 < len(kinds) <= MOST_KINDS and all(isinstance(kind, str) for kind in kinds):
            return {
                str(kind): [row for row in rows if row[field] == kind]
                for kind in dict.fromkeys(r[field] for r in rows)
            }
    return {"": list(rows)}


def _stream(name: str, rows: Sequence[Cells]) -> tuple[Stream, dict[str, Mask]]:
    """A stream of rows, and by column those (n,) that lack it."""
    columns, text, empty = {}, {}, {}
    for field in dict.fromkeys(field for row in rows for field in row):
        cells = _numbers([row.get(field) for row in rows])
        blank = np.array([cell is None for cell in cells])
        if any(isinstance(cell, str) for cell in cells):
            text[field] = tuple("" if cell is None else str(cell) for cell in cells)
            continue
        columns[field] = np.array([np.nan if cell is None else cell for cell in cells], np.float64)
        if blank.any():
            empty[field] = blank
    return Stream(name, columns, text), empty


def _numbers(cells: list[Any]) -> list[Any]:
    """Cells of numbers, where those in words are numbers too, as "0.25" or "NaN"; others as they are."""
    try:
        return [float(cell) if isinstance(cell, str) else cell for cell in cells]
    except ValueError:
        return cells
