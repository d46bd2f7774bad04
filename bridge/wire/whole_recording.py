"""The complete recording of a dive, the recordings that it replaces, and those that went on after it was made.

The complete recording holds everything that the ground heard, byte for byte, so that the last frames of each
recording show whether it lacks any. Frames of file transfers are left out of it and are not looked for.
"""

import re
from collections import Counter
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Final

from bridge.errors import LogError
from bridge.text import typed
from bridge.wire.redaction import FILE_TRANSFER
from bridge.wire.tlog import GZIP, STAMP_BYTES, load_bytes, next_record, record_of

WHOLE: Final = "telemetry.whole.tlog"
"""Lies next to the ground's `telemetry.tlog`, which stays unchanged. Holds its frames and those the vehicle kept."""


def number(file: Path) -> int:
    """Number of a file within its dive's recording: 1 for `telemetry.tlog`, 2 for `telemetry.2.tlog`, begun next."""
    digits = re.search(r"\.(\d+)\.", file.name)
    return int(digits.group(1)) if digits else 1


def files_to_read(recordings: Sequence[Path]) -> list[Path]:
    """Return the recordings of a dive to read: the complete recording if present, otherwise all recordings."""
    whole = [path for path in recordings if path.name == WHOLE]
    return whole or list(recordings)


LAST: Final = 8
"""Number of last frames of a vehicle that are compared: one of them states a time that no other frame does."""
TAIL_BYTES: Final = 1 << 16
GROUNDS: Final = 240
"""System ids from here on are ground stations', whose heartbeats repeat byte for byte."""


def with_unmerged_frames(recordings: Sequence[Path]) -> list[Path]:
    """Return the recordings of a dive with frames that its complete recording lacks; [] without a complete recording.

    A recording that can't be read counts as lacking nothing.
    """
    whole = next((path for path in recordings if path.name == WHOLE), None)
    if whole is None:
        return []
    try:
        held = load_bytes(whole)[0]
    except LogError:
        return []
    # Searched from the end, as most lie there.
    return [
        recording
        for recording in recordings
        if recording != whole and any(held.rfind(raw) < 0 for raw in _last(recording))
    ]


def unmerged_words(folder: Path, lacking: Iterable[Path]) -> str:
    """Return a sentence for the crew; "" if nothing is lacking."""
    files = list(lacking)
    if not files:
        return ""
    names = " and ".join(file.name for file in files)
    have = "has" if len(files) == 1 else "have"
    return (
        f"{names} {have} frames that {WHOLE} lacks, and these are not read: "
        f"`{typed('seatrial', 'merge', folder, *files)}` adds them."
    )


def _last(recording: Path) -> list[bytes]:
    """The last frames of a vehicle in a recording, in the form that a complete recording would hold."""
    try:
        data = _tail(recording, TAIL_BYTES)
        frames = _of_vehicles(data)
        return frames or _of_vehicles(load_bytes(recording)[0])
    except (LogError, OSError):
        return []


def _tail(recording: Path, most: int) -> bytes:
    """Up to the last `most` bytes of a recording; all bytes, decompressed, if it is gzip."""
    if not recording.is_file():
        return b""
    with recording.open("rb") as file:
        if file.read(len(GZIP)) == GZIP:
            return load_bytes(recording)[0]
        file.seek(max(recording.stat().st_size - most, 0))
        return file.read(most)


def _of_vehicles(data: bytes) -> list[bytes]:
    position, frames = 0, []
    while (record := next_record(data, position, Counter())) is not None:
        position, _, frame = record
        if frame.system < GROUNDS and frame.message_id != FILE_TRANSFER and frame.known:
            frames.append(record_of(0, frame.raw)[STAMP_BYTES:])
    return frames[-LAST:]
