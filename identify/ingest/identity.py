"""What a recording is known by: its bytes, unfolded where they lie compressed, and the first of them."""

import hashlib
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from bridge.tlog import load_bytes

OPENING_BYTES = 1 << 16
"""Some seconds of telemetry: hundreds of stamps in microseconds and of noisy readings, which no other dive repeats."""


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
