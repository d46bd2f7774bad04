"""What a recording is known by: its bytes, unfolded where they lie compressed, and the first of them."""

import hashlib
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from bridge.tlog import load_bytes

OPENING_BYTES = 1 << 16
"""Some seconds of telemetry: hundreds of stamps in microseconds and of noisy readings, which no other dive repeats."""

SAME, PIECE, OVERLAPPING = "holds the same recording as", "is a piece of", "shares a stretch with"
"""How one recording may be of the same dive as another, in words between their names."""


@dataclass(frozen=True)
class Identity:
    """`sha256` of all `size_bytes`; `opening`: that of the first OPENING_BYTES, by which a copy that was cut is known.

    `opening` is empty where the recording is shorter, and where two dives can begin alike: a table, or a DataFlash log,
    which opens with its own formats.
    """

    sha256: str
    opening: str
    size_bytes: int


def identity_of(files: Sequence[Path]) -> Identity:
    """The identity of the recording in these files, one after another. Raises LogError where one can't be read."""
    data = contents(files)
    told = files[0].name.lower().endswith((".tlog", ".tlog.gz")) and len(data) >= OPENING_BYTES
    opening = hashlib.sha256(data[:OPENING_BYTES]).hexdigest() if told else ""
    return Identity(hashlib.sha256(data).hexdigest(), opening, len(data))


def contents(files: Sequence[Path]) -> bytes:
    """The bytes of a recording's files, one after another, unfolded. Raises LogError."""
    return b"".join(load_bytes(file)[0] for file in files)


def of_one_dive(files: Sequence[Path], others: Sequence[Path]) -> str:
    """How the recording in `files` is of the very dive that is in `others`, in words; "" where it is not.

    Of a `.tlog` any piece is known by its bytes, wherever it was cut; of other formats, which open with what every
    dive of theirs has, only a whole or its beginning. Raises LogError where one can't be read.
    """
    one, other = contents(files), contents(others)
    if one == other:
        return SAME
    if not (one and other):
        return ""
    short, long = sorted((one, other), key=len)
    if short in long:
        return PIECE if short is one else OVERLAPPING
    told = _is_tlog(files) and _is_tlog(others) and len(short) >= OPENING_BYTES
    return OVERLAPPING if told and (one[:OPENING_BYTES] in other or other[:OPENING_BYTES] in one) else ""


def _is_tlog(files: Sequence[Path]) -> bool:
    return files[0].name.lower().endswith((".tlog", ".tlog.gz"))
