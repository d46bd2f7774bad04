"""Identifies a recording by its uncompressed bytes, and by the first of them."""

import hashlib
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from bridge.tlog import load_bytes

OPENING_BYTES = 1 << 16
"""Some seconds of telemetry: hundreds of microsecond stamps and noisy readings, which no other dive repeats."""

SAME, PIECE, OVERLAPPING = "holds the same recording as", "is a piece of", "shares a stretch with"
"""Relations between two recordings of the same dive, worded to stand between their names."""


@dataclass(frozen=True)
class Identity:
    """`sha256` of all `size_bytes`; `opening`: SHA-256 of the first OPENING_BYTES, to recognise a copy that was cut.

    `opening` is empty if the recording is shorter, and for formats in which two dives can begin alike: a table, or a
    DataFlash log, which opens with its own formats.
    """

    sha256: str
    opening: str
    size_bytes: int


def identity_of(files: Sequence[Path]) -> Identity:
    """Identity of the recording in these files, concatenated. Raises LogError if a file can't be read."""
    data = contents(files)
    has_opening = files[0].name.lower().endswith((".tlog", ".tlog.gz")) and len(data) >= OPENING_BYTES
    opening = hashlib.sha256(data[:OPENING_BYTES]).hexdigest() if has_opening else ""
    return Identity(hashlib.sha256(data).hexdigest(), opening, len(data))


def contents(files: Sequence[Path]) -> bytes:
    """Uncompressed bytes of a recording's files, concatenated. Raises LogError."""
    return b"".join(load_bytes(file)[0] for file in files)


def of_one_dive(files: Sequence[Path], others: Sequence[Path]) -> str:
    """How the recording in `files` overlaps with the dive in `others`, in words; "" if it does not.

    In any format, a recording whose bytes are contained in the other is recognised. Two `.tlog` that only overlap are
    recognised if the other holds the opening of one of them; other formats open with bytes that every dive of theirs
    has. Raises LogError if a file can't be read.
    """
    data, other_data = contents(files), contents(others)
    if data == other_data:
        return SAME
    if not (data and other_data):
        return ""
    short, long = sorted((data, other_data), key=len)
    if short in long:
        return PIECE if short is data else OVERLAPPING
    comparable = _is_tlog(files) and _is_tlog(others) and len(short) >= OPENING_BYTES
    return (
        OVERLAPPING
        if comparable and (data[:OPENING_BYTES] in other_data or other_data[:OPENING_BYTES] in data)
        else ""
    )


def _is_tlog(files: Sequence[Path]) -> bool:
    return files[0].name.lower().endswith((".tlog", ".tlog.gz"))
