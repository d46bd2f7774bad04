"""The finished files of a recording: sync them to the disk, and watch them as long as their dive lasts.

They stay open until then, since a deleted file can still be read while it is open, and is written again under its name.
A file that was moved with its folder is left in its new place, and reported.
"""

import contextlib
import math
import os
from collections.abc import Callable
from dataclasses import dataclass
from enum import Enum, auto
from typing import Final, Protocol

from bridge.clock import Clock
from bridge.errors import LogError, TakenAway

Say = Callable[[str, str], None]
"""Callback for a notice: level and sentence."""

AGAIN_S: Final = 8.0
TOLD_S: Final = 60.0
"""How long the restoring of a deleted file is reported."""
MOST_OPEN: Final = 64
"""Most files kept open: a disk that fails repeatedly makes a file each time; earlier files are as safe as possible."""


class Writer(Protocol):
    """Output file of a recording; every method but `close` raises LogError when it fails."""

    def write(self, unix_us: int, raw: bytes) -> None: ...

    def sync(self) -> None: ...

    def look(self) -> None:
        """Check that the file is in its place. Raises TakenAway if it was deleted or moved."""
        ...

    def restore(self) -> None:
        """Write a deleted file again under its name."""
        ...

    def close(self) -> None: ...


class _Lies(Enum):
    HERE = auto()
    ELSEWHERE = auto()
    NOWHERE = auto()


@dataclass(eq=False, slots=True)
class _Past:
    """A finished file of dive number `dive`, with its counts of frames and bytes."""

    writer: Writer
    dive: int
    frames: int
    bytes: int
    is_synced: bool = False
    lies: _Lies = _Lies.HERE
    again_s: float = 0.0
    place: str = ""
    restored_s: float = -math.inf


class PastFiles:
    """The finished files. One thread calls `add`, another `see_to`; both may read the counts."""

    def __init__(self, clock: Clock, say: Say) -> None:
        self._clock, self._say = clock, say
        self._past: list[_Past] = []

    def add(self, writer: Writer, dive: int, frames: int, size: int) -> None:
        """Take over a finished file with its counts."""
        self._past.append(_Past(writer, dive, frames, size))

    def missing(self, dive: int) -> tuple[int, int]:
        """Frames and bytes that were written in that dive and are no longer in its folder."""
        gone = [past for past in list(self._past) if past.dive == dive and past.lies is not _Lies.HERE]
        return sum(past.frames for past in gone), sum(past.bytes for past in gone)

    def elsewhere(self, dive: int) -> int:
        """Number of frames of that dive in files that were moved."""
        moved = [past for past in list(self._past) if past.dive == dive and past.lies is _Lies.ELSEWHERE]
        return sum(past.frames for past in moved)

    def nowhere(self) -> int:
        """Number of frames in files that were deleted and could not be written again, of all dives so far."""
        return sum(past.frames for past in list(self._past) if past.lies is _Lies.NOWHERE)

    def taken_away(self, dive: int) -> str:
        """Sentence about files of that dive that were moved or deleted; "" if all are in its folder."""
        past = [file for file in list(self._past) if file.dive == dive]
        moved = [file for file in past if file.lies is _Lies.ELSEWHERE]
        if moved:
            places = " and ".join(dict.fromkeys(_where(file.place) for file in moved))
            return (
                f"this dive was moved while it is recorded: {sum(file.frames for file in moved)} frames lie "
                f"{places}; the recording goes on in its old place"
            )
        since_s = self._clock.boot_s() - TOLD_S
        restored = [file for file in past if file.restored_s >= since_s and file.lies is _Lies.HERE]
        if restored:
            frames = sum(file.frames for file in restored)
            return f"this dive was deleted while it is recorded: {frames} frames are written anew"
        return ""

    def see_to(self, dive: int) -> None:
        """Sync the files, check that they are in place, and close the files of dives before `dive`."""
        for past in list(self._past):
            self._see_to(past)
            over = past.dive < dive or not past.frames
            if (over and past.lies is not _Lies.NOWHERE) or (
                past.lies is _Lies.HERE and len(self._past) > MOST_OPEN
            ):
                _close(past.writer)
                self._past.remove(past)

    def close(self) -> None:
        """Sync and check the files a last time, and close them."""
        for past in list(self._past):
            past.again_s = self._clock.boot_s()
            self._see_to(past)
            _close(past.writer)

    def _see_to(self, past: _Past) -> None:
        try:
            if not past.is_synced:
                past.is_synced = True
                past.writer.sync()
            past.writer.look()
            past.lies = _Lies.HERE
        except TakenAway as taken:
            if past.frames:
                self._taken_away(past, taken)
        except LogError as error:
            self._say("error", str(error))

    def _taken_away(self, past: _Past, taken: TakenAway) -> None:
        if taken.place is not None:
            if past.lies is not _Lies.ELSEWHERE:
                past.lies, past.place = _Lies.ELSEWHERE, taken.place
                self._say("warning", f"{taken.path}: was moved with its {past.frames} frames ({taken.place})")
            return
        if self._clock.boot_s() < past.again_s:
            return
        try:
            past.writer.restore()
        except LogError as error:
            past.lies, past.again_s = _Lies.NOWHERE, self._clock.boot_s() + AGAIN_S
            self._say("error", f"{error}; its {past.frames} frames are lost with it if that lasts")
        else:
            past.lies, past.restored_s = _Lies.HERE, self._clock.boot_s()
            self._say("warning", f"{taken.path}: was deleted, and is written once more: {past.frames} frames")


def _where(place: str) -> str:
    """Place of a moved file in words: its folder, if the system reports it."""
    folder = os.path.dirname(place)
    return f"in {folder}" if folder else place


def _close(writer: Writer) -> None:
    """Close a file; an error of closing is ignored, as nothing depends on it."""
    with contextlib.suppress(OSError):
        writer.close()
