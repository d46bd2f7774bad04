"""Find the bytes of a recording that belong to no message: how many, and at which place."""

from pathlib import Path
from typing import Final

from bridge.errors import LogError

OF_A_RECORD: Final = 30
"""Bytes after the last payload that may still belong to it: checksum, signature, and a partial stamp after a cut."""


def stray_bytes(recording: Path) -> str:
    """A sentence about a recording or a dive folder; "" if each byte of its `.tlog` belongs to a message.

    Raises LogError if there is no recording.
    """
    from identify.ingest.open import recording_files

    files = [file for file in recording_files(recording) if file.name.endswith((".tlog", ".tlog.gz"))]
    names = [file.name if file == recording else f"{recording.name}/{file.name}" for file in files]
    return ". ".join(filter(None, map(_of, files, names)))


def _of(file: Path, name: str) -> str:
    from identify.ingest.salvage import locate

    try:
        located = locate(file)
    except LogError:
        # The reader of the dive reports a file that is empty or can't be read.
        return ""
    count = located.counts["skipped"]
    if not count:
        return ""
    behind = len(located.data) - int(located.start[-1] + located.length[-1]) if len(located.start) else count
    if behind >= count:
        position = "at its end"
    else:
        position = "between its messages and at its end" if behind > OF_A_RECORD else "between its messages"
    return f"{name}: {count} bytes {position} belong to no message and were left out"
