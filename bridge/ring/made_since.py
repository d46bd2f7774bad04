"""What a dive's whole recording lacks of those that it was made of, since they went on or came after it was made.

All that the ground heard is in it, byte for byte, so that the last frames of each recording tell. What it had of the
vehicle's transfer of files is left out of it, and is not asked for.
"""

from collections import Counter
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Final

from bridge.errors import LogError
from bridge.ftp.contents import FILE_TRANSFER
from bridge.ring.whole import WHOLE
from bridge.tlog import GZIP, STAMP_BYTES, load_bytes, next_record, record_of

LAST: Final = 8
"""Frames of a vehicle: one of them states a time that no other does."""
TAIL_BYTES: Final = 1 << 16
AFTERWARDS: Final = f"after {WHOLE} was made"
GROUNDS: Final = 240
"""System ids from here on are ground stations', whose heartbeats come again byte for byte."""


def lacked(recordings: Sequence[Path]) -> list[Path]:
    """Those of a dive's recordings of which the whole one among them lacks frames; none where there is no whole one.

    One that can't be read lacks nothing that could be told.
    """
    whole = next((path for path in recordings if path.name == WHOLE), None)
    if whole is None:
        return []
    try:
        held = load_bytes(whole)[0]
    except LogError:
        return []
    # Most lie at its end.
    return [one for one in recordings if one != whole and any(held.rfind(raw) < 0 for raw in _last(one))]


def lacked_words(folder: Path, lacking: Iterable[Path]) -> str:
    """A sentence for the crew; "" where nothing is lacking."""
    files = list(lacking)
    if not files:
        return ""
    names = " and ".join(file.name for file in files)
    return (
        f"{names} went on, or came, {AFTERWARDS}, and what that lacks of it is not read: "
        f"`seatrial merge {folder} {files[0]}` puts it in."
    )


def _last(recording: Path) -> list[bytes]:
    """Its last frames of a vehicle, as a whole recording would hold them."""
    try:
        data = _tail(recording, TAIL_BYTES)
        found = _of_vehicles(data)
        return found or _of_vehicles(load_bytes(recording)[0])
    except (LogError, OSError):
        return []


def _tail(recording: Path, most: int) -> bytes:
    """Up to its last `most` bytes; all of one that is folded."""
    if not recording.is_file():
        return b""
    with recording.open("rb") as file:
        if file.read(len(GZIP)) == GZIP:
            return load_bytes(recording)[0]
        file.seek(max(recording.stat().st_size - most, 0))
        return file.read(most)


def _of_vehicles(data: bytes) -> list[bytes]:
    position, found = 0, []
    while (record := next_record(data, position, Counter())) is not None:
        position, _, frame = record
        if frame.system < GROUNDS and frame.message_id != FILE_TRANSFER and frame.known:
            found.append(record_of(0, frame.raw)[STAMP_BYTES:])
    return found[-LAST:]
