"""The ground's copy of the segments that a vehicle recorded: each under its own name, so that no byte is fetched twice.

A `.part` is a segment that is not complete: it holds the first bytes of the segment without a gap, whenever the program
was killed. A `.other-N` is a complete segment whose name the vehicle now uses for a different one. Bytes that no
frame's checksum confirms are `doubtful`: only the vehicle can say whether it has the same.
"""

import contextlib
import os
import shutil
from collections import Counter
from collections.abc import Iterator
from itertools import count
from pathlib import Path
from typing import BinaryIO, Final

from bridge.errors import LogError
from bridge.files import PART, is_own_file, open_own, remedy
from bridge.locks import try_lock
from bridge.wire.ftp import crc32
from bridge.wire.tlog import MOST_BYTES, STAMP_BYTES, next_record

Stretch = tuple[int, int]
"""A stretch of bytes: offset and length."""


def doubtful(data: bytes) -> list[Stretch]:
    """Return the stretches of bytes between intact records, by offset: damage, impossible stamps, unknown frame types.

    A ring writes complete records back to back, so most segments have no such stretch.
    """
    stretches: list[Stretch] = []
    position, passed = 0, Counter[str]()
    while (record := next_record(data, position, passed)) is not None:
        end, stamp_us, frame = record
        frame_begins = end - len(frame.raw) - (0 if stamp_us is None else STAMP_BYTES)
        intact_from = frame_begins if frame.known else end
        if intact_from > position:
            stretches.append((position, intact_from - position))
        position = end
    if position < len(data):
        stretches.append((position, len(data) - position))
    return stretches


def damaged_before(data: bytes) -> list[int]:
    """For each damaged place, return the number, from 0, of the intact record after it.

    For damage at the end this is the number of all records. A file that was only cut off counts as undamaged.
    """
    numbers: list[int] = []
    position, number, counts = 0, 0, Counter[str]()
    while True:
        known = counts["checksum"]
        record = next_record(data, position, counts)
        numbers += [number] * (counts["checksum"] - known)
        if record is None:
            return numbers
        position, number = record[0], number + 1


PIECE_BYTES: Final = 1 << 20
LOCK: Final = "fetching.lock"


class Mirror:
    """Segments in `folder`, which is created when needed. Every method that writes raises LogError if writing fails."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder

    @contextlib.contextmanager
    def locked(self) -> Iterator[None]:
        """Keep other processes from writing to the mirror; the system releases the lock if this process is killed.

        Raises LogError if another process holds the lock, or the lock file can't be written.
        """
        with self._opened(LOCK) as file:
            if not try_lock(file.fileno()):
                raise LogError(
                    f"{self._folder}: another fetch is at work there; wait for its end, then fetch again"
                )
            yield

    def _opened(self, name: str) -> BinaryIO:
        """Open a file of the mirror for appending.

        Raises LogError, also if something other than a regular file has this name: a folder that came from someone
        else may hold a link that leads out of it, or a pipe that nobody reads.
        """
        path = self._folder / name
        try:
            if self._folder.is_symlink():
                raise LogError(f"{self._folder}: leads elsewhere; take that link away and fetch again")
            if os.path.lexists(self._folder) and not self._folder.is_dir():
                raise LogError(f"{self._folder}: is no folder; take it away and fetch again")
            self._folder.mkdir(parents=True, exist_ok=True)
            if os.path.lexists(path) and not is_own_file(path):
                raise _no_file(path)
            return open_own(path)
        except OSError as error:
            raise _unwritten(path, error) from None

    def require_space(self, more: int) -> None:
        """Raise LogError if the disk has no room for `more` bytes: nothing can be recorded on a full disk."""
        place = next(folder for folder in (self._folder, *self._folder.parents) if folder.exists())
        free = shutil.disk_usage(place).free
        if more > free:
            raise LogError(
                f"{self._folder}: the vehicle's recording needs {more / 1e6:.0f} MB, and {free / 1e6:.0f} MB are free; "
                "free disk space and fetch again"
            )

    def path(self, name: str) -> Path:
        """Path of a segment: the complete file, otherwise its `.part`, which may not exist yet."""
        return self._folder / (name if self.is_whole(name) else name + PART)

    def size(self, name: str) -> int:
        """How many of the segment's first bytes are here. Raises LogError if its path is not a regular file."""
        path = self.path(name)
        if not os.path.lexists(path):
            return 0
        if not is_own_file(path):
            raise _no_file(path)
        return path.stat().st_size

    def is_whole(self, name: str) -> bool:
        """Whether the complete segment is here, with its checksum confirmed."""
        return is_own_file(self._folder / name)

    def append(self, name: str, data: bytes) -> None:
        """Add bytes to the end of an incomplete segment."""
        path = self._folder / (name + PART)
        try:
            with self._opened(path.name) as file:
                file.write(data)
        except OSError as error:
            raise _unwritten(path, error) from None

    def checksum(self, name: str) -> int:
        """Checksum of the bytes here, as MAVLink FTP computes it."""
        crc = 0
        with contextlib.suppress(FileNotFoundError), self.path(name).open("rb") as file:
            while data := file.read(PIECE_BYTES):
                crc = crc32(data, crc)
        return crc

    def read(self, name: str, at: int, size: int) -> bytes:
        """Read `size` bytes of a segment at offset `at`. Raises LogError if it can't be read."""
        path = self.path(name)
        try:
            with path.open("rb") as file:
                file.seek(at)
                return file.read(size)
        except OSError as error:
            raise _unread(path, error) from None

    def doubtful(self, name: str) -> list[Stretch]:
        """Return the stretches that only the vehicle can confirm. Raises LogError if the segment can't be read."""
        path = self.path(name)
        try:
            size = path.stat().st_size
            return doubtful(path.read_bytes()) if size <= MOST_BYTES else [(0, size)]
        except OSError as error:
            raise _unread(path, error) from None

    def finish(self, name: str) -> None:
        """Mark a segment as complete."""
        path = self._folder / (name + PART)
        try:
            # A segment that is empty so far has no file yet.
            with self._opened(path.name) as file:
                os.fsync(file.fileno())
            path.replace(self._folder / name)
        except OSError as error:
            raise _unwritten(self._folder / name, error) from None

    def set_aside(self, name: str) -> None:
        """Keep a complete segment under another name: the vehicle has a different segment under this name."""
        path = self._folder / name
        candidates = (path.with_name(f"{name}.other-{number}") for number in count(1))
        try:
            path.rename(next(candidate for candidate in candidates if not candidate.exists()))
        except OSError as error:
            raise LogError(
                f"{path}: can't be set aside ({error.strerror}); check the disk and fetch again"
            ) from None

    def drop(self, name: str) -> None:
        """Delete the incomplete segment, to begin it anew."""
        with contextlib.suppress(OSError):
            (self._folder / (name + PART)).unlink()


def _no_file(path: Path) -> LogError:
    return LogError(f"{path}: is no file; take it away and fetch again")


def _unwritten(path: Path, error: OSError) -> LogError:
    return LogError(f"{path}: can't be written ({error.strerror}); {remedy(error)} and fetch again")


def _unread(path: Path, error: OSError) -> LogError:
    return LogError(f"{path}: can't be read ({error.strerror}); check the disk and fetch again")
