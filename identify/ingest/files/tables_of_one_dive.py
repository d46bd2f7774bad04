"""One dive in several tables: programs that export a log, and loggers, write a table a topic or a sensor into a folder.

The runs of a vehicle, each a table, have the same columns; the topics of a dive have none in common but the time and a
counter. So a folder is one dive where no two of its tables have half of their columns in common.
"""

import re
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Final

from bridge.arrays import Mask
from bridge.errors import LogError
from identify.ingest.files.streams import Stream, Streams, some_of
from identify.ingest.files.text_table import TABLES, column_names, read_table
from identify.ingest.mapping.names import time_unit

MOST_SHARED: Final = 0.5
"""Two tables are of one kind if they share so many of the smaller one's columns."""
NUMBERED: Final = re.compile(r"[-_. ]*\d[-_.\dTZ]*$")
"""The number or the date of a recording, at the end of a table's name."""


def tables_of_one_dive(folder: Path) -> list[Path]:
    """The tables of a folder that are the topics of one dive, by name; none if they are runs, or a single table.

    Tables without a column that is a time by its name, or without any other, are no topics.
    """
    signals_of: dict[Path, set[str]] = {}
    for file in sorted(filter(_is_table, folder.iterdir())):
        names = _names(file)
        signals = {name for name in names if not _is_time(name)}
        if not signals or len(signals) == len(names):
            continue
        signals_of[file] = signals
        others = [each for other, each in signals_of.items() if other != file]
        if any(
            len(signals_of[file] & each) >= MOST_SHARED * min(len(signals_of[file]), len(each))
            for each in others
        ):
            return []
    return [*signals_of] if len(signals_of) > 1 else []


def read_tables(files: Sequence[Path]) -> Streams:
    """The tables as the topics of one recording, each named as its file is, without the number of the recording at the
    end of the names. Raises LogError.

    A table of the same folder that is not among them is named in a note.
    """
    topics, notes, empty = list[Stream](), list[str](), dict[str, Mask]()
    for file, name in zip(files, topic_names(files), strict=True):
        table = read_table(file)
        (rows,) = table.streams
        topic = Stream(name, rows.columns, rows.text, rows.dates)
        topics.append(topic)
        notes += [f"{file.name}: {note}" for note in table.notes]
        empty |= {topic.full_name(column): mask for column, mask in table.empty.items()}
    others = [
        file.name for file in sorted(files[0].parent.iterdir()) if _is_table(file) and file not in files
    ]
    if others:
        notes.append(f"Left out, since no column is named a time: {some_of(others)}.")
    return Streams(tuple(topics), tuple(notes), empty)


def topic_names(files: Iterable[Path]) -> list[str]:
    """Names of the topics in these tables, `dvl` of `dvl_20260110.csv`; the whole names if two would be equal."""
    whole = [_stem(file) for file in files]
    short = [NUMBERED.sub("", name) for name in whole]
    return short if all(short) and len({*short}) == len(short) else whole


def _is_table(file: Path) -> bool:
    return file.is_file() and file.name.lower().endswith(TABLES) and not file.name.startswith(".")


def _is_time(name: str) -> bool:
    return time_unit(name)[0]


def _names(file: Path) -> Sequence[str]:
    try:
        return column_names(file)
    except LogError:
        return ()


def _stem(file: Path) -> str:
    ending = next(ending for ending in TABLES if file.name.lower().endswith(ending))
    return file.name[: -len(ending)]
