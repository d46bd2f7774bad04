"""The files of a recording: frames go into the present file, into a new file when that fails, and into the next dive's.

A file that is deleted or moved ends with an error, within a second, and the recording goes on in a new one. Frames that
can't be written yet wait in memory, up to a bound. Files are opened, written and given up only in the thread of
`drain`; another thread syncs them. `DiskLeft` watches the disk's free space.
"""

import contextlib
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Final

from bridge.clock import Clock
from bridge.errors import LogError, TakenAway
from bridge.wire.tlog import TlogWriter

LOOK_EVERY_S: Final = 2.0
WARN_S: Final = 600.0
LEAST_FREE_BYTES: Final = 1_000_000
MEAN_OVER_S: Final = 60.0
"""Averaging time of the rate for `left_s`; periods without data do not count."""


class DiskLeft:
    """Watches the free space of the recording's disk.

    `free_bytes` returns the free space on the disk, or raises OSError; `warn` is called with a sentence. `left_s` is
    the time until the disk is full at the rate of the arriving bytes, written or not; inf if nothing arrives.
    """

    def __init__(self, free_bytes: Callable[[], int], warn: Callable[[str], None], now_s: float) -> None:
        self._free_bytes, self._warn = free_bytes, warn
        self._looked_s = now_s
        self._bytes = 0
        self._is_short = False
        self._mean_rate = self._came_for_s = 0.0
        self.left_s = float("inf")

    @property
    def has_room(self) -> bool:
        """Whether there is room to begin another file."""
        return (self._space() or 0) >= LEAST_FREE_BYTES

    def came(self, count: int) -> None:
        """`count` bytes arrived over a link."""
        self._bytes += count

    def look(self, now_s: float) -> None:
        """Update `left_s` and warn if the disk is nearly full; does so every LOOK_EVERY_S."""
        span_s = now_s - self._looked_s
        if span_s < LOOK_EVERY_S:
            return
        rate = self._bytes / span_s
        self._looked_s, self._bytes = now_s, 0
        free = self._space()
        if free is None:
            return
        if rate > 0:  # a silence does not change the rate at which bytes arrive after it
            self._came_for_s = min(self._came_for_s + span_s, MEAN_OVER_S)
            self._mean_rate += min(span_s / self._came_for_s, 1.0) * (rate - self._mean_rate)
        self.left_s = free / self._mean_rate if rate > 0 else float("inf")
        short = self.left_s < WARN_S or free < LEAST_FREE_BYTES
        if short and not self._is_short:
            minutes = f"about {self.left_s / 60:.0f} min of recording" if rate > 0 else "next to nothing"
            self._warn(f"the disk has {free / 1e6:.1f} MB left, {minutes}; free some space")
        self._is_short = short

    def _space(self) -> int | None:
        """Free bytes; None if the disk is not there, which the writer of the files reports."""
        try:
            return self._free_bytes()
        except OSError:
            return None


Say = Callable[[str, str], None]
"""Callback for a notice: level and sentence."""


MOST_WAITING_BYTES: Final = 16_000_000
FIRST_RETRY_S: Final = 1.0
RETRY_MAX_S: Final = 8.0


@dataclass(frozen=True, slots=True)
class Kept:
    """Counts of the files that are in a dive's folder: of its first, and of others that hold frames.

    `lost` counts the frames that are in none of them: never written, or in a file that was deleted or moved meanwhile.
    """

    files: int
    frames: int
    bytes: int
    lost: int


class RecordedFiles:
    """Writes frames to the files of a dive.

    `open_file(n)` opens the n-th file of a dive, from 1; the first is opened at once, later ones only if `has_room`.
    All counts are those of the present dive.
    """

    def __init__(
        self, open_file: Callable[[int], TlogWriter], clock: Clock, has_room: Callable[[], bool], say: Say
    ) -> None:
        self._open_file, self._clock, self._has_room, self._say = open_file, clock, has_room, say
        self._waiting: deque[tuple[int, bytes]] = deque()
        self._waiting_bytes = 0
        self._failure = ""
        self._sync_failure: LogError | None = None
        self._following: Callable[[], None] | None = None
        self._given_up: deque[tuple[TlogWriter, bool]] = deque()
        self._begin(open_file(1))

    def _begin(self, writer: TlogWriter) -> None:
        self._writer: TlogWriter | None = writer
        self._fresh, self._retry_s, self._retry_delay_s = True, self._clock.boot_s(), FIRST_RETRY_S
        self._number = self._files = 1
        self._frames = self._bytes = self._lost = 0
        self._frames_before = self._bytes_before = 0

    @property
    def kept(self) -> Kept:
        """Counts of the present dive's files."""
        return Kept(self._files, self._frames, self._bytes, self._lost)

    @property
    def waiting(self) -> int:
        """Number of frames that could not be written yet."""
        return len(self._waiting)

    @property
    def unwritten(self) -> str:
        """Why the last attempt to write failed, while frames wait; "" if none waits."""
        return self._failure if self._waiting else ""

    def put(self, unix_us: int, raw: bytes) -> None:
        """Write a frame, or keep it in memory until it can be written."""
        self._waiting.append((unix_us, raw))
        self._waiting_bytes += len(raw)
        self.drain()

    def drain(self) -> None:
        """Write the waiting frames, as far as possible now; beyond MOST_WAITING_BYTES the oldest are lost."""
        failure, self._sync_failure = self._sync_failure, None
        if failure is not None:
            self._fail(failure)
        while self._waiting:
            if self._writer is None and (self._clock.boot_s() < self._retry_s or not self._has_room()):
                break
            stamp_us, raw = self._waiting[0]
            try:
                if self._writer is None:
                    self._open_next()
                if self._writer is None:
                    break
                self._writer.write(stamp_us, raw)
            except LogError as error:
                self._fail(error)
                continue
            self._waiting.popleft()
            self._waiting_bytes -= len(raw)
            if self._is_litter:
                self._files += 1
                self._say("warning", f"the recording goes on in its file {self._number}")
            self._fresh, self._retry_delay_s = False, FIRST_RETRY_S
            self._frames += 1
            self._bytes += len(raw)
        while self._waiting_bytes > MOST_WAITING_BYTES:
            self._waiting_bytes -= len(self._waiting.popleft()[1])
            self._lost += 1

    def go_on(self, open_file: Callable[[int], TlogWriter], changed: Callable[[Kept], None]) -> None:
        """Begin the next dive with the next `change`; may be called from another thread.

        `changed` is called with the counts of the dive that ended. Raises LogError if the first file can't be opened,
        or if a next dive is already pending: then nothing changes.
        """
        if self._following is not None:
            raise LogError("the next dive waits for the disk already; check the disk")
        self._following = partial(self._change_to, open_file(1), open_file, changed)

    def change(self) -> None:
        """Change to the next dive's files if one is pending; frames that could not be written yet go there."""
        following, self._following = self._following, None
        if following is not None:
            following()

    def _change_to(
        self, first: TlogWriter, open_file: Callable[[int], TlogWriter], changed: Callable[[Kept], None]
    ) -> None:
        self.drain()
        self._give_up()
        self._open_file = open_file
        kept = self.kept
        self._begin(first)
        changed(kept)

    def sync(self) -> None:
        """Sync the written frames to the disk, and see that their file is in its place; call it from another thread
        than `drain`.
        """
        while self._given_up:
            given_up, is_litter = self._given_up.popleft()
            with contextlib.suppress(LogError, OSError):
                given_up.sync()
            _close(given_up)
            if is_litter:
                _remove_empty(given_up.path)
        writer = self._writer
        if writer is None:
            return
        try:
            writer.sync()
            writer.look()
        except LogError as error:
            if writer is self._writer:
                self._sync_failure = error

    def close(self) -> None:
        """Write the waiting frames at once, and close."""
        self._retry_s = self._clock.boot_s()
        self.drain()
        if self._waiting:
            self._say("error", f"{len(self._waiting)} frames could not be written and are lost")
            self._lost += len(self._waiting)
        self.sync()
        if self._sync_failure is not None:
            self._fail(self._sync_failure)
        if self._writer is not None:
            _close(self._writer)
            self._writer = None
        self.sync()

    @property
    def _is_litter(self) -> bool:
        """Whether the present file, another than the dive's first, holds no frame: a disk that fails for long would be
        littered with such files."""
        return self._fresh and self._number > 1

    def _open_next(self) -> None:
        self._number += 1
        try:
            self._writer = self._open_file(self._number)
            self._fresh = True
        except LogError as error:
            self._failure = str(error)
            self._say("error", self._failure)
            self._delay()

    def _fail(self, error: LogError) -> None:
        self._failure = str(error)
        if isinstance(error, TakenAway):
            frames = self._frames - self._frames_before
            self._failure += f"; its {frames} frames are not in the dive's folder any more"
            self._lost += frames
            self._files -= 0 if self._is_litter else 1
            self._frames, self._bytes = self._frames_before, self._bytes_before
        self._say("error", self._failure)
        self._give_up()
        if self._fresh:
            self._delay()
        else:
            self._retry_s = self._clock.boot_s()

    def _give_up(self) -> None:
        """Write nothing more to the present file; the syncing thread syncs and closes it.

        Its frames must survive a power loss, and waiting for the disk here would lose the frames that arrive meanwhile.
        """
        if self._writer is None:
            return
        self._frames_before, self._bytes_before = self._frames, self._bytes
        self._given_up.append((self._writer, self._is_litter))
        self._writer = None

    def _delay(self) -> None:
        self._retry_s = self._clock.boot_s() + self._retry_delay_s
        self._retry_delay_s = min(2 * self._retry_delay_s, RETRY_MAX_S)


def _close(writer: TlogWriter) -> None:
    """Close a file that was synced: a network disk may fail once more here, with nothing left to lose."""
    with contextlib.suppress(OSError):
        writer.close()


def _remove_empty(path: Path) -> None:
    with contextlib.suppress(OSError):
        if not path.stat().st_size:
            path.unlink()
