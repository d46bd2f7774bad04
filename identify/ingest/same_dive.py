"""Whether two recordings are of one dive, by their bytes: copies, pieces, and recordings that overlap."""

import hashlib
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from bridge.errors import LogError
from bridge.files import size_to_read
from bridge.wire.tlog import SUFFIXES, load_bytes
from identify.ingest.files.text_table import TABLES

HASHED_BYTES = 1 << 24
OPENING_BYTES = 1 << 16
"""Some seconds of telemetry: hundreds of microsecond stamps and noisy readings, which no other dive repeats."""

SAME, PIECE, OVERLAPPING = "holds the same recording as", "is a piece of", "shares a stretch with"
"""Relations between two recordings of the same dive, worded to stand between their names."""


@dataclass(frozen=True)
class Identity:
    """Marks that identify a recording: SHA-256 of all `size_bytes`, and of its opening.

    `opening`, of the first OPENING_BYTES, recognises a copy that was cut. It is empty if the recording is shorter, and
    for formats in which two dives can begin alike: a table, or a DataFlash log, which opens with its own formats.
    """

    sha256: str
    opening: str
    size_bytes: int


def identity_of(files: Sequence[Path]) -> Identity:
    """Identity of the recording in these files, concatenated. Raises LogError if a file can't be read."""
    if _is_hashed(files):
        return _hashed(files)
    data = contents(files)
    has_opening = _is_tlog(files) and len(data) >= OPENING_BYTES
    opening = hash_of(data[:OPENING_BYTES]) if has_opening else ""
    return Identity(hash_of(data), opening, len(data))


def hash_of(data: bytes) -> str:
    """SHA-256, as hexadecimal text."""
    return hashlib.sha256(data).hexdigest()


def contents(files: Sequence[Path]) -> bytes:
    """Uncompressed bytes of a recording's files, concatenated. Raises LogError."""
    return b"".join(load_bytes(file)[0] for file in files)


def _is_hashed(files: Sequence[Path]) -> bool:
    """Whether a recording is known by its hash alone, for its files may be larger than the memory."""
    return not files[0].name.lower().endswith((*SUFFIXES, ".bin", *TABLES))


def _hashed(files: Sequence[Path]) -> Identity:
    digest, size = hashlib.sha256(), 0
    for file in files:
        try:
            if size_to_read(file) is None:
                raise LogError("is no file; take it away", file)
            with file.open("rb") as opened:
                while piece := opened.read(HASHED_BYTES):
                    digest.update(piece)
                    size += len(piece)
        except OSError as error:
            raise LogError(f"can't be read ({error.strerror}); give a recording that can", file) from None
    return Identity(digest.hexdigest(), "", size)


def of_one_dive(files: Sequence[Path], others: Sequence[Path]) -> str:
    """How the recording in `files` overlaps with the dive in `others`, in words; "" if it does not.

    In any format, a recording whose bytes are contained in the other is recognised. Two `.tlog` that only overlap are
    recognised if the other holds the opening of one of them; other formats open with bytes that every dive of theirs
    has. Files that may be larger than the memory are recognised if they are the same. Raises LogError if a file
    can't be read.
    """
    if _is_hashed(files) or _is_hashed(others):
        return SAME if identity_of(files).sha256 == identity_of(others).sha256 else ""
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
    return files[0].name.lower().endswith(SUFFIXES)
