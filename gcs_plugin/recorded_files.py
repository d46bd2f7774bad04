"""The files of a recording: each frame into the present one, the next where that fails, and those of the next dive.

What can't be written yet waits in memory, up to a bound. A file is only ever opened, written and given up in the thread
of `drain`; another thread may put it on the disk, and sees to it that it stays there, see `past_files`.
"""

from collections import deque
from collections.abc import Callable
from dataclasses import dataclass
from typing import Final

from bridge.clock import Clock
from bridge.errors import LogError
from gcs_plugin.past_files import PastFiles, Say, Writer

MOST_WAITING_BYTES: Final = 16_000_000
FIRST_RETRY_S: Final = 1.0
RETRY_MAX_S: Final = 8.0


@dataclass(frozen=True, slots=True)
class Kept:
    """What the files of a dive hold that lie in its folder.

    `lost` are the frames that no file took, and those in files that somebody deleted for good; `moved` those in files
    that somebody moved elsewhere.
    """

    files: int
    frames: int
    bytes: int
    lost: int
    moved: int


@dataclass(frozen=True)
class _Following:
    """Where the next dive goes."""

    writer: Writer
    open_file: Callable[[int], Writer]
    changed: Callable[[Kept], None]


class RecordedFiles:
    """`open_file(n)` makes the n-th file of a dive, from 1, the first at once; `has_room` tells whether it may.

    All counts are the present dive's.
    """

    def __init__(
        self, open_file: Callable[[int], Writer], clock: Clock, has_room: Callable[[], bool], say: Say
    ) -> None:
        self._open_file, self._clock, self._has_room, self._say = open_file, clock, has_room, say
        self._waiting: deque[tuple[int, bytes]] = deque()
        self._waiting_bytes = 0
        self._sync_failure = self._failure = ""
        self._following: _Following | None = None
        self._past, self._dive = PastFiles(clock, say), 0
        self._begin(open_file(1))

    def _begin(self, writer: Writer) -> None:
        """A dive begins with this file."""
        self._writer: Writer | None = writer
        self._fresh, self._retry_s, self._retry_delay_s = True, self._clock.boot_s(), FIRST_RETRY_S
        self.files, self._dive, self._lost_before = 1, self._dive + 1, self._past.nowhere()
        self._frames = self._bytes = self._untaken = 0
        self._frames_before = self._bytes_before = 0

    @property
    def kept(self) -> Kept:
        """What the present dive's files hold."""
        frames, size = self._past.missing(self._dive)
        moved = self._past.elsewhere(self._dive)
        return Kept(self.files, self._frames - frames, self._bytes - size, self.lost, moved)

    @property
    def taken_away(self) -> str:
        """What somebody moved or deleted of the present dive, in a sentence; "" where all lies in its folder."""
        return self._past.taken_away(self._dive)

    @property
    def lost(self) -> int:
        """How many frames no file took, or were deleted for good."""
        return self._untaken + max(0, self._past.nowhere() - self._lost_before)

    @property
    def waiting(self) -> int:
        """How many frames could not be written yet."""
        return len(self._waiting)

    @property
    def unwritten(self) -> str:
        """What the newest try to write failed of, while frames wait for it; "" where none does."""
        return self._failure if self._waiting else ""

    def put(self, unix_us: int, raw: bytes) -> None:
        """Write a frame, or keep it until it can be."""
        self._waiting.append((unix_us, raw))
        self._waiting_bytes += len(raw)
        self.drain()

    def drain(self) -> None:
        """Write what waits, as far as that can be done now."""
        if self._sync_failure:
            self._fail(self._sync_failure)
            self._sync_failure = ""
        while self._waiting:
            if self._writer is None and not self._may_open():
                break
            stamp_us, raw = self._waiting[0]
            try:
                if self._writer is None:
                    self._open_next()
                if self._writer is None:
                    break
                self._writer.write(stamp_us, raw)
            except LogError as error:
                self._fail(str(error))
                continue
            self._waiting.popleft()
            self._waiting_bytes -= len(raw)
            if self._fresh and self.files > 1:
                self._say("warning", f"the recording goes on in its file {self.files}")
            self._fresh, self._retry_delay_s = False, FIRST_RETRY_S
            self._frames += 1
            self._bytes += len(raw)
        while self._waiting_bytes > MOST_WAITING_BYTES:
            self._waiting_bytes -= len(self._waiting.popleft()[1])
            self._untaken += 1

    def go_on(self, open_file: Callable[[int], Writer], changed: Callable[[Kept], None]) -> None:
        """Begin the next dive with the next `change`; may be called from another thread.

        `changed` hears what the files before hold. Raises LogError where the first file can't be made, or a next dive
        waits already: all stays as it is.
        """
        if self._following is not None:
            raise LogError("the next dive waits for the disk already; check the disk")
        self._following = _Following(open_file(1), open_file, changed)

    def change(self) -> None:
        """Go on in the next dive's files where one is to begin; what could not be written yet goes there."""
        following, self._following = self._following, None
        if following is None:
            return
        self.drain()
        self._give_up()
        self._open_file = following.open_file
        kept = self.kept
        self._begin(following.writer)
        following.changed(kept)

    def sync(self) -> None:
        """Put what is written on the disk; to be called from another thread than `drain`."""
        self._past.see_to(self._dive)
        writer = self._writer
        if writer is None:
            return
        try:
            writer.sync()
            writer.look()
        except LogError as error:
            if writer is self._writer:
                self._sync_failure = str(error)

    def close(self) -> None:
        """Write what waits, at once, and close."""
        self._retry_s = self._clock.boot_s()
        self.drain()
        if self._waiting:
            self._say("error", f"{len(self._waiting)} frames could not be written and are lost")
            self._untaken += len(self._waiting)
        self._give_up()
        self._past.close()

    def _may_open(self) -> bool:
        return self._clock.boot_s() >= self._retry_s and self._has_room()

    def _open_next(self) -> None:
        self.files += 1
        try:
            self._writer = self._open_file(self.files)
            self._fresh = True
        except LogError as error:
            self._failure = str(error)
            self._say("error", self._failure)
            self._delay()

    def _fail(self, sentence: str) -> None:
        self._failure = sentence
        self._say("error", sentence)
        self._give_up()
        if self._fresh:
            self._delay()
        else:
            self._retry_s = self._clock.boot_s()

    def _give_up(self) -> None:
        """Nothing more goes into the present file; it is closed by who syncs.

        Waiting for the disk here would lose what the links bring meanwhile, and what it holds is to outlast a loss of
        power.
        """
        if self._writer is None:
            return
        frames, size = self._frames - self._frames_before, self._bytes - self._bytes_before
        self._frames_before, self._bytes_before = self._frames, self._bytes
        self._past.add(self._writer, self._dive, frames, size)
        self._writer = None

    def _delay(self) -> None:
        self._retry_s = self._clock.boot_s() + self._retry_delay_s
        self._retry_delay_s = min(2 * self._retry_delay_s, RETRY_MAX_S)
