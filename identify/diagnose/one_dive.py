"""Whether two recordings are of one dive: the same bytes, packed or not, a piece of them, or a stretch in common."""

from collections.abc import Sequence
from pathlib import Path

from identify.ingest.identity import OPENING_BYTES, contents

SAME, PIECE, OVERLAPPING = "holds the same recording as", "is a piece of", "shares a stretch with"
"""How one recording may be of the same dive as another, in words between their names."""


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
