"""Bytes of a recording that belong to no message: how many, and where."""

from pathlib import Path
from typing import Final

from bridge.errors import LogError

OF_A_RECORD: Final = 30
"""Bytes behind the last payload that may still be its own: checksum, signature; and what a cut leaves of a stamp."""


def stray_bytes(recording: Path) -> str:
    """A sentence of a recording or a dive folder, "" where each byte of its `.tlog` belongs to a message.

    Raises LogError where there is none.
    """
    from identify.ingest.open import recording_files

    files = [file for file in recording_files(recording) if file.name.endswith((".tlog", ".tlog.gz"))]
    names = [file.name if file == recording else f"{recording.name}/{file.name}" for file in files]
    return ". ".join(filter(None, map(_of, files, names)))


def _of(file: Path, name: str) -> str:
    from identify.ingest.salvage import locate

    try:
        found = locate(file)
    except LogError:
        # What reads the dive says of a file that holds nothing, or can't be read.
        return ""
    count = found.counts["skipped"]
    if not count:
        return ""
    behind = len(found.data) - int(found.start[-1] + found.length[-1]) if len(found.start) else count
    if behind >= count:
        where = "at its end"
    else:
        where = "between its messages and at its end" if behind > OF_A_RECORD else "between its messages"
    return f"{name}: {count} bytes {where} belong to no message and were left out"
