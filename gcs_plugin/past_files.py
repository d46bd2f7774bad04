"""The files of a recording that nothing more goes into: put on the disk, and seen to as long as their dive lasts.

They stay open till then, since what somebody deletes meanwhile can still be read from the open file, and is written
once more under its name. What somebody moves away with its folder is left where it is, and told.
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
"""Hears a level and a sentence."""

AGAIN_S: Final = 8.0
TOLD_S: Final = 60.0
"""For so long it is told that a deleted file was written once more."""
MOST_OPEN: Final = 64
"""A disk that fails again and again makes a file each time; those before are as safe as any on such a disk."""


class Writer(Protocol):
    """What a recording is written to; every method but `close` raises LogError where it fails."""

    def write(self, unix_us: int, raw: bytes) -> None: ...

    def sync(self) -> None: ...

    def look(self) -> None:
        """Raises TakenAway where somebody deleted or moved it."""
        ...

    def restore(self) -> None:
        """Write it once more under its name, where it was deleted."""
        ...

    def close(self) -> None: ...


class _Lies(Enum):
    HERE = auto()
    ELSEWHERE = auto()
    NOWHERE = auto()


@dataclass(eq=False, slots=True)
class _Past:
    """A file of the `dive`-th dive, and what it took."""

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
    """Added to in one thread, seen to in another; the counts may be asked for in either."""

    def __init__(self, clock: Clock, say: Say) -> None:
        self._clock, self._say = clock, say
        self._past: list[_Past] = []

    def add(self, writer: Writer, dive: int, frames: int, size: int) -> None:
        """Nothing more goes into this one."""
        self._past.append(_Past(writer, dive, frames, size))

    def missing(self, dive: int) -> tuple[int, int]:
        """Frames and bytes that were written in that dive and do not lie in its folder."""
        gone = [past for past in list(self._past) if past.dive == dive and past.lies is not _Lies.HERE]
        return sum(past.frames for past in gone), sum(past.bytes for past in gone)

    def elsewhere(self, dive: int) -> int:
        """Frames of that dive whose files somebody moved."""
        moved = [past for past in list(self._past) if past.dive == dive and past.lies is _Lies.ELSEWHERE]
        return sum(past.frames for past in moved)

    def nowhere(self) -> int:
        """Frames whose files somebody deleted, and that could not be written once more, of any dive so far."""
        return sum(past.frames for past in list(self._past) if past.lies is _Lies.NOWHERE)

    def taken_away(self, dive: int) -> str:
        """What somebody moved or deleted of that dive, in a sentence; "" where all lies in its folder."""
        past = [one for one in list(self._past) if one.dive == dive]
        moved = [one for one in past if one.lies is _Lies.ELSEWHERE]
        if moved:
            places = " and ".join(dict.fromkeys(_where(one.place) for one in moved))
            return (
                f"this dive was moved while it is recorded: {sum(one.frames for one in moved)} frames lie "
                f"{places}; the recording goes on in its old place"
            )
        since_s = self._clock.boot_s() - TOLD_S
        anew = [one for one in past if one.restored_s >= since_s and one.lies is _Lies.HERE]
        if anew:
            frames = sum(one.frames for one in anew)
            return f"this dive was deleted while it is recorded: {frames} frames are written anew"
        return ""

    def see_to(self, dive: int) -> None:
        """Put them on the disk, look whether they are there, and close those before that dive."""
        for past in list(self._past):
            self._see_to(past)
            over = past.dive < dive or not past.frames
            if (over and past.lies is not _Lies.NOWHERE) or (
                past.lies is _Lies.HERE and len(self._past) > MOST_OPEN
            ):
                _close(past.writer)
                self._past.remove(past)

    def close(self) -> None:
        """See to them for the last time."""
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
    """In which folder, where the system tells it."""
    folder = os.path.dirname(place)
    return f"in {folder}" if folder else place


def _close(writer: Writer) -> None:
    """What its close has to say changes nothing."""
    with contextlib.suppress(OSError):
        writer.close()
