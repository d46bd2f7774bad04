"""The ring: the vehicle's own bounded recording of the frames it sends, so that a dive without a link is not lost.

Records go into the newest segment, the oldest segments are deleted. `RingKeeper` takes frames over at once and writes
them in a thread of its own: a disk that is full, fails or stalls delays nothing. Frames that can't be written wait in
memory up to a bound; then the oldest are lost and counted. The crew gets a text when this begins, each minute while
writing fails, and when it is over.
"""

import contextlib
import secrets
from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from threading import Event, Lock, Thread
from typing import Final

from bridge.clock import Clock
from bridge.errors import LogError, TakenAway
from bridge.wire.readings import milliseconds
from bridge.wire.segments import Segment, following, segments_in
from bridge.wire.tlog import STAMP_BYTES, TlogWriter


@dataclass(frozen=True)
class RingSize:
    """Size limits of a ring and of each of its segments, in bytes."""

    total: int
    segment: int


class RingFiles:
    """The segments of one boot, known by `identity`, in `folder`, which is created if missing.

    Nothing is touched before the first `write`, so that a vehicle starts with a failing disk too. Files that are no
    segments are left alone.
    """

    def __init__(self, folder: Path, bounds: RingSize, identity: int) -> None:
        self._folder, self._bounds, self.identity = folder, bounds, identity
        self._boot = 0
        self._number = 0
        self._size = 0
        self._writer: TlogWriter | None = None

    def write(self, unix_us: int, boot_ms: int, raw: bytes) -> None:
        """Append one record. Raises LogError if that fails; the next record then begins a new segment."""
        if self._writer is not None and self._size + STAMP_BYTES + len(raw) > self._bounds.segment:
            self.sync()
            self.close()
        try:
            if self._writer is None:
                self._writer, self._size = self._begin(boot_ms), 0
            self._writer.write(unix_us, raw)
        except LogError:
            self._give_up()
            raise
        self._size += STAMP_BYTES + len(raw)

    def sync(self) -> None:
        """Put the written records on the disk. Raises LogError if that fails, TakenAway if the segment is gone."""
        if self._writer is None:
            return
        try:
            self._writer.sync()
            self._writer.look()
        except LogError:
            self.close()
            raise

    def close(self) -> None:
        if self._writer is not None:
            with contextlib.suppress(OSError):
                self._writer.close()
            self._writer = None

    def _give_up(self) -> None:
        """End a segment that can't be written, with its records; an empty segment would be litter and is deleted."""
        writer = self._writer
        with contextlib.suppress(LogError):
            self.sync()
        self.close()
        if writer is not None and self._size == 0:
            with contextlib.suppress(OSError):
                writer.path.unlink()

    def _begin(self, boot_ms: int) -> TlogWriter:
        try:
            self._folder.mkdir(parents=True, exist_ok=True)
            present = segments_in(self._folder)
            self._boot = self._boot or following(segment for segment, _ in present)
            self._make_room(present)
        except OSError as error:
            raise LogError(f"{self._folder}: the ring can't be kept there ({error.strerror})") from None
        self._number += 1
        segment = Segment(self._boot, self.identity, self._number, boot_ms)
        return TlogWriter(self._folder / segment.name)

    def _make_room(self, present: list[tuple[Segment, int]]) -> None:
        """Delete the oldest segments until one more segment fits."""
        total = sum(size for _, size in present)
        for segment, size in present:
            if total + self._bounds.segment <= self._bounds.total:
                return
            (self._folder / segment.name).unlink(missing_ok=True)
            total -= size


MOST_WAITING_BYTES: Final = 8_000_000
SYNC_EVERY_S: Final = 0.5
RETRY_S: Final = 2.0
TELL_AGAIN_S: Final = 60.0  # for a crew that joins the link later
ENDING_S: Final = 3.0
IDENTITY_BITS: Final = 31  # a positive int32 on the wire


def ring_in(folder: Path, bounds: RingSize, clock: Clock) -> "RingKeeper":
    """Return the ring of this boot in a folder, not yet started; a random number tells the boot from all others."""
    return RingKeeper(RingFiles(folder, bounds, secrets.randbits(IDENTITY_BITS) or 1), clock)


class RingKeeper:
    """Keeps the frames of the boot that `files` are of. `put` and `take_texts` never wait for the disk.

    `start` starts the thread that writes. Without it, as in lock-step, call `write_waiting` instead.
    """

    def __init__(self, files: RingFiles, clock: Clock) -> None:
        self.identity = files.identity
        self._files, self._clock = files, clock
        self._waiting: deque[tuple[int, int, bytes]] = deque()
        self._waiting_bytes = 0
        self._lost = 0
        self._fault, self._next_text_s = "", 0.0
        self._texts: list[str] = []
        self._lock, self._wake, self._stop = Lock(), Event(), Event()
        self._next_try_s = self._next_sync_s = clock.boot_s()
        self._thread: Thread | None = None

    @property
    def fault(self) -> str:
        """Why nothing is written now, a sentence; "" while the disk takes all."""
        return self._fault

    def start(self) -> None:
        """Start a thread that writes from now on."""
        self._thread = Thread(target=self._run, name="ring", daemon=True)
        self._thread.start()

    def put(self, unix_us: int, boot_s: float, frames: Sequence[bytes]) -> None:
        """Take over complete frames that were sent at that time."""
        boot_ms = milliseconds(boot_s)
        with self._lock:
            for raw in frames:
                self._waiting.append((unix_us, boot_ms, raw))
                self._waiting_bytes += len(raw)
            while self._waiting_bytes > MOST_WAITING_BYTES:
                self._waiting_bytes -= len(self._waiting.popleft()[2])
                self._lost += 1
                if self._lost == 1:
                    self._texts.append("ring: disk too slow or full, frames are lost")
        self._wake.set()

    def take_texts(self) -> list[str]:
        """Return the texts for the crew since the last call."""
        with self._lock:
            texts, self._texts = self._texts, []
        return texts

    def write_waiting(self) -> None:
        """Write the waiting frames as far as possible now, and sync them to the disk twice a second."""
        now_s = self._clock.boot_s()
        if now_s < self._next_try_s:
            return
        try:
            self._write()
            if now_s >= self._next_sync_s:
                self._next_sync_s = now_s + SYNC_EVERY_S
                self._files.sync()
        except TakenAway as taken:
            fate = "deleted" if taken.place is None else "moved away"
            self._say(f"ring: files were {fate}, it begins anew")
        except LogError as error:
            self._fail(str(error), now_s)

    def close(self) -> None:
        """Write the waiting frames, and end. A disk that stalls is not waited for long."""
        self._stop.set()
        self._wake.set()
        if self._thread is None:
            self._end()
        else:
            self._thread.join(ENDING_S)

    def _run(self) -> None:
        while not self._stop.is_set():
            self._wake.wait(SYNC_EVERY_S)
            self._wake.clear()
            self.write_waiting()
        self._end()

    def _end(self) -> None:
        self._next_try_s = self._next_sync_s = self._clock.boot_s()
        self.write_waiting()
        self._files.close()

    def _write(self) -> None:
        while True:
            with self._lock:
                if not self._waiting:
                    return
                record = self._waiting.popleft()
                self._waiting_bytes -= len(record[2])
            try:
                self._files.write(*record)
            except LogError:
                with self._lock:
                    self._waiting.appendleft(record)
                    self._waiting_bytes += len(record[2])
                raise
            self._recover()

    def _fail(self, fault: str, now_s: float) -> None:
        self._next_try_s = now_s + RETRY_S
        said = f"ring: not written, {fault}"
        if not self._fault or now_s >= self._next_text_s:
            self._next_text_s = now_s + TELL_AGAIN_S
            self._say(said)
        # The first one: each attempt names a file of another number.
        self._fault = self._fault or said

    def _say(self, text: str) -> None:
        with self._lock:
            self._texts.append(text)

    def _recover(self) -> None:
        """Report that nothing waits any more, after a failure or after frames that found no room."""
        with self._lock:
            if self._waiting or not (self._fault or self._lost):
                return
            lost, self._lost, self._fault = self._lost, 0, ""
            self._texts.append(f"ring: written again, {lost} frames lost")
