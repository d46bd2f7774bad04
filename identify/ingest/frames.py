"""MAVLink frames of a recording as arrays, decoded by message id.

Hundreds of thousands of records are read at once. A frame is therefore a row of `Frames`, and a field of all messages
of an id becomes an array, taken from the recording's bytes when it is asked for.
"""

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from itertools import accumulate
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pymavlink.dialects.v20 import ardupilotmega as dialect

from bridge.tlog import of_those_that_hold_frames
from identify.ingest.salvage import locate
from identify.ingest.walk import Bytes, Rows, copy_field

_WIRE_TYPES = {
    "char": "S1", "uint8_t": "u1", "int8_t": "i1", "uint16_t": "<u2", "int16_t": "<i2", "uint32_t": "<u4",
    "int32_t": "<i4", "uint64_t": "<u8", "int64_t": "<i8", "float": "<f4", "double": "<f8",
}  # fmt: skip


@dataclass(frozen=True)
class Frames:
    """The intact frames of a recording, in file order, one per row.

    `arrival_s` is the record's Unix time; `start` and `length` locate the payload in `data`. `counts` are those of
    the reader: records read and lost.
    """

    data: Bytes
    arrival_s: NDArray[np.float64]
    start: Rows
    length: Rows
    system: Rows
    component: Rows
    message: Rows
    counts: dict[str, int]

    def __len__(self) -> int:
        return len(self.start)

    def rows(self, name: str) -> Rows:
        """Row numbers of all frames of the message called `name`."""
        return np.flatnonzero(self.message == message_id(name))


@dataclass(frozen=True)
class Fields:
    """The fields of the messages called `name` at `rows` of `frames`."""

    frames: Frames
    name: str
    rows: Rows

    def __len__(self) -> int:
        return len(self.rows)

    def __contains__(self, field: str) -> bool:
        return field in _layout(self.name)

    def __getitem__(self, field: str) -> NDArray[Any]:
        """Values (n,), or (n, k) for an array; bytes missing from a short payload are zero."""
        return self.first(field, None)

    def first(self, field: str, count: int | None) -> NDArray[Any]:
        """First `count` values of an array field, (n, count); None means all."""
        kind, offset = _layout(self.name)[field]
        if count is not None:
            kind = np.dtype((kind.base, (min(count, *kind.shape),)))
        out = np.empty((len(self.rows), kind.itemsize), np.uint8)
        frames = self.frames
        copy_field(frames.data, frames.start, frames.length, self.rows, offset, out)
        values = out.view(kind.base)
        return values if kind.shape else values[:, 0]

    def at(self, chosen: NDArray[Any]) -> "Fields":
        """A subset of the messages, by index or mask."""
        return Fields(self.frames, self.name, self.rows[chosen])


def load_frames(paths: Sequence[Path]) -> Frames:
    """All intact frames of a recording in one or more `.tlog` or `.tlog.gz` files, in their order.

    Raises LogError if a file can't be read, or if none holds a frame. `counts` lists files without frames as "files
    empty".
    """
    files = list(of_those_that_hold_frames(paths, locate))
    counts: Counter[str] = Counter()
    if len(files) < len(paths):
        counts["files empty"] = len(paths) - len(files)
    for file in files:
        counts.update(file.counts)
    if len(files) == 1:
        data, shifts = files[0].data, [0]
    else:
        data = np.concatenate([file.data for file in files])
        shifts = [0, *accumulate(len(file.data) for file in files[:-1])]
    return Frames(
        data,
        np.concatenate([file.stamp_us for file in files]).astype(np.float64) * 1e-6,
        np.concatenate([file.start + shift for file, shift in zip(files, shifts, strict=True)]),
        np.concatenate([file.length for file in files]),
        np.concatenate([file.system for file in files]),
        np.concatenate([file.component for file in files]),
        np.concatenate([file.message for file in files]),
        dict(counts),
    )


def message_id(name: str) -> int:
    return int(_message_class(name).id)


def message_name(identifier: int) -> str:
    """Name of a message id, or its number if the dialect lacks it."""
    kind = dialect.mavlink_map.get(identifier)
    return str(kind.msgname) if kind else f"message {identifier}"


def _message_class(name: str) -> Any:
    return getattr(dialect, f"MAVLink_{name.lower()}_message")


@cache
def _layout(name: str) -> dict[str, tuple[np.dtype[Any], int]]:
    """Type and payload offset of each field."""
    cls = _message_class(name)
    types = dict(zip(cls.fieldnames, cls.fieldtypes, strict=True))
    layout: dict[str, tuple[np.dtype[Any], int]] = {}
    offset = 0
    for field, count in zip(cls.ordered_fieldnames, cls.array_lengths, strict=True):
        wire = _WIRE_TYPES[types[field]]
        if count:
            kind = np.dtype(f"S{count}") if wire == "S1" else np.dtype((wire, (count,)))
        else:
            kind = np.dtype(wire)
        layout[field] = kind, offset
        offset += kind.itemsize
    return layout
