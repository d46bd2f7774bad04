"""MAVLink frames of a recording as arrays, decoded by message id.

Tens of thousands of records are read at once, so a frame is a row of `Frames`, and all messages of one id
become one numpy structured array.
"""

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pymavlink.dialects.v20 import ardupilotmega as dialect

from bridge.framing import MAGIC_2
from bridge.tlog import TlogReader

HEADER_1_BYTES, HEADER_2_BYTES = 6, 10

_WIRE_TYPES = {
    "char": "S1", "uint8_t": "u1", "int8_t": "i1", "uint16_t": "<u2", "int16_t": "<i2", "uint32_t": "<u4",
    "int32_t": "<i4", "uint64_t": "<u8", "int64_t": "<i8", "float": "<f4", "double": "<f8",
}  # fmt: skip


@dataclass(frozen=True)
class Frames:
    """The good frames of a recording, in file order, one row each.

    `arrival_s` is the record's Unix time; `start` and `length` locate the payload in `data`. `counts` are the
    reader's: what was read and what was lost.
    """

    data: NDArray[np.uint8]
    arrival_s: NDArray[np.float64]
    start: NDArray[np.int64]
    length: NDArray[np.int64]
    system: NDArray[np.int64]
    component: NDArray[np.int64]
    message: NDArray[np.int64]
    counts: dict[str, int]

    def __len__(self) -> int:
        return len(self.start)

    def rows(self, name: str) -> NDArray[np.int64]:
        """Row numbers of all frames of the message called `name`."""
        return np.flatnonzero(self.message == message_id(name))

    def decode(self, name: str, rows: NDArray[np.int64]) -> NDArray[Any]:
        """The messages `name` at `rows` as a structured array; what a short payload leaves out is zero."""
        layout = _layout(name)
        width = min(layout.itemsize, int(self.length[rows].max(initial=0)))
        payload = np.zeros((len(rows), layout.itemsize), np.uint8)
        columns = np.arange(width)
        index = np.minimum(self.start[rows, None] + columns, len(self.data) - 1)
        payload[:, :width] = np.where(columns < self.length[rows, None], self.data[index], 0)
        return payload.view(layout)[:, 0]


def load_frames(paths: Sequence[Path]) -> Frames:
    """All good frames of a recording in one or more `.tlog` or `.tlog.gz` files, in their order.

    Raises LogError where one can't be read, is empty or holds no frame.
    """
    readers = [TlogReader(path) for path in paths]
    records = [record for reader in readers for record in reader if record[1].known]
    counts: Counter[str] = Counter()
    for reader in readers:
        counts.update(reader.counts)
    raws = [frame.raw for _, frame in records]
    sizes = np.array([len(raw) for raw in raws], np.int64)
    data = np.frombuffer(b"".join(raws), np.uint8)
    begin = np.cumsum(sizes) - sizes
    return Frames(
        data,
        np.array([stamp for stamp, _ in records], np.float64) * 1e-6,
        begin + np.where(data[begin] == MAGIC_2, HEADER_2_BYTES, HEADER_1_BYTES),
        data[begin + 1].astype(np.int64),
        np.array([frame.system for _, frame in records], np.int64),
        np.array([frame.component for _, frame in records], np.int64),
        np.array([frame.message_id for _, frame in records], np.int64),
        dict(counts),
    )


def message_id(name: str) -> int:
    return int(_message_class(name).id)


def message_name(identifier: int) -> str:
    """The name of a message id, or its number where the dialect has none."""
    kind = dialect.mavlink_map.get(identifier)
    return str(kind.msgname) if kind else f"message {identifier}"


def _message_class(name: str) -> Any:
    return getattr(dialect, f"MAVLink_{name.lower()}_message")


@cache
def _layout(name: str) -> np.dtype[Any]:
    cls = _message_class(name)
    types = dict(zip(cls.fieldnames, cls.fieldtypes, strict=True))
    fields: list[Any] = []
    for field, count in zip(cls.ordered_fieldnames, cls.array_lengths, strict=True):
        kind = types[field]
        if kind == "char" and count:
            fields.append((field, f"S{count}"))
        elif count:
            fields.append((field, _WIRE_TYPES[kind], (count,)))
        else:
            fields.append((field, _WIRE_TYPES[kind]))
    return np.dtype(fields)
