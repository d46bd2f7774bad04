"""Reads a PX4 log (`.ulg`) into streams, one for each topic and instance."""

import contextlib
import io
import re
import struct
from pathlib import Path
from typing import BinaryIO

import numpy as np

from bridge.errors import LogError
from identify.ingest.files.optional_libraries import library
from identify.ingest.files.streams import LONGEST_LIST, Stream, Streams

EXTRA = "ulog"
TIMESTAMP, STAMP = "timestamp", "stamp"
LEAD_BYTES = 3
_ELEMENT = re.compile(r"\[(\d+)\]")
_UNREADABLE = (ValueError, KeyError, IndexError, TypeError, OverflowError, struct.error)


def read_ulog(path: Path) -> Streams:
    """The topics of a log: `vehicle_attitude`, and of further instances `vehicle_attitude_1`.

    Columns are the numeric fields, elements of a list numbered from 0 as in `q.0`, `timestamp` in us since boot, and
    `stamp`, the same in s. Raises LogError.
    """
    pyulog = library("pyulog", EXTRA, path)
    try:
        with path.open("rb") as opened, contextlib.redirect_stdout(io.StringIO()):
            file = _Watched(opened)
            log = pyulog.ULog(file)
    except OSError as error:
        raise LogError(f"can't be read ({error.strerror}); give a recording that can", path) from None
    except (pyulog.core.ULogException, *_UNREADABLE):
        raise LogError("is no ULog, or its beginning is damaged; check the file", path) from None
    streams = []
    for topic in sorted(log.data_list, key=lambda topic: (topic.name, topic.multi_id)):
        words = {held.field_name for held in topic.field_data if held.type_str == "char"}
        long = _long(topic.data)
        columns = {
            _ELEMENT.sub(r".\1", name): np.asarray(values, np.float64)
            for name, values in topic.data.items()
            if name not in words and name.partition("[")[0] not in long
        }
        if TIMESTAMP in columns and len(columns[TIMESTAMP]):
            columns[STAMP] = columns[TIMESTAMP] * 1e-6
            streams.append(
                Stream(f"{topic.name}_{topic.multi_id}" if topic.multi_id else topic.name, columns, {})
            )
    if not streams:
        raise LogError("holds no data of any topic; check the log", path)
    damaged = log.file_corruption or file.is_cut
    notes = (f"{path.name} is cut off or damaged: what is intact was read.",) if damaged else ()
    return Streams(tuple(streams), notes)


def _long(names: object) -> set[str]:
    """Names of the fields that are lists of more numbers than are read."""
    return {name.partition("[")[0] for name in map(str, names) if name.endswith(f"[{LONGEST_LIST}]")}  # type: ignore[call-overload]


class _Watched:
    """A file that knows whether it ended within a message; the library reads over that in silence."""

    def __init__(self, file: BinaryIO) -> None:
        self._file, self.is_cut = file, False
        self.tell, self.seek, self.close = file.tell, file.seek, file.close

    def read(self, size: int) -> bytes:
        data = self._file.read(size)
        # A log may end where the lead of a message would begin.
        if len(data) < size and (data or size != LEAD_BYTES):
            self.is_cut = True
        return data
