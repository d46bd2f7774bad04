"""What the ground has of vehicles' rings: each segment under its own name, so that no byte is fetched twice.

A segment that is not whole yet is a `.part`: the beginning of it, without a hole, whenever the program ends. A
`.other-N` was whole under a name under which the vehicle now has something else.
"""

import contextlib
import os
import shutil
from collections.abc import Iterator
from itertools import count
from pathlib import Path
from typing import BinaryIO, Final

from bridge.errors import LogError
from bridge.file_size import is_own_file
from bridge.ftp.server import crc32
from bridge.new_file import PART, open_own, remedy
from bridge.tlog import MOST_BYTES
from gcs_plugin.fetch.doubtful import Stretch, doubtful
from gcs_plugin.file_lock import locked

PIECE_BYTES: Final = 1 << 20
LOCK: Final = "fetching.lock"


class Mirror:
    """Segments in `folder`, made where it is missing. Every method that writes raises LogError where it can't."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder

    @contextlib.contextmanager
    def alone(self) -> Iterator[None]:
        """While nobody else writes into it; the system lets go of it where a process is killed.

        Raises LogError where another does, or it can't be written.
        """
        with self._opened(LOCK) as file:
            if not locked(file.fileno()):
                raise LogError(
                    f"{self._folder}: another fetch is at work there; wait for its end, then fetch again"
                )
            yield

    def _opened(self, name: str) -> BinaryIO:
        """A file of the mirror, to be written at its end. Raises LogError, also where something else lies there: a
        folder of somebody else's may hold a link out of it, or a pipe that nobody reads."""
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

    def need(self, more: int) -> None:
        """Raises LogError where the disk has no room for so many bytes more: a disk that is full records nothing."""
        place = next(one for one in (self._folder, *self._folder.parents) if one.exists())
        free = shutil.disk_usage(place).free
        if more > free:
            raise LogError(
                f"{self._folder}: the vehicle's recording needs {more / 1e6:.0f} MB, and {free / 1e6:.0f} MB are free; "
                "free disk space and fetch again"
            )

    def path(self, name: str) -> Path:
        """Where what there is of a segment lies."""
        return self._folder / (name if self.is_whole(name) else name + PART)

    def size(self, name: str) -> int:
        """How many of its first bytes are there. Raises LogError where what should hold them is no file."""
        path = self.path(name)
        if not os.path.lexists(path):
            return 0
        if not is_own_file(path):
            raise _no_file(path)
        return path.stat().st_size

    def is_whole(self, name: str) -> bool:
        """Whether all of it is there, and its checksum was right."""
        return is_own_file(self._folder / name)

    def append(self, name: str, data: bytes) -> None:
        """The next bytes of it."""
        path = self._folder / (name + PART)
        try:
            with self._opened(path.name) as file:
                file.write(data)
        except OSError as error:
            raise _unwritten(path, error) from None

    def checksum(self, name: str) -> int:
        """MAVLink FTP's, of what there is."""
        crc = 0
        with contextlib.suppress(FileNotFoundError), self.path(name).open("rb") as file:
            while data := file.read(PIECE_BYTES):
                crc = crc32(data, crc)
        return crc

    def piece(self, name: str, at: int, size: int) -> bytes:
        """Bytes of what there is. Raises LogError where it can't be read."""
        path = self.path(name)
        try:
            with path.open("rb") as file:
                file.seek(at)
                return file.read(size)
        except OSError as error:
            raise _unread(path, error) from None

    def doubtful(self, name: str) -> list[Stretch]:
        """What of it only the vehicle can speak for. Raises LogError where it can't be read."""
        path = self.path(name)
        try:
            size = path.stat().st_size
            return doubtful(path.read_bytes()) if size <= MOST_BYTES else [(0, size)]
        except OSError as error:
            raise _unread(path, error) from None

    def finish(self, name: str) -> None:
        """It is whole."""
        path = self._folder / (name + PART)
        try:
            # Of one that was begun and holds nothing there is no file yet.
            with self._opened(path.name) as file:
                os.fsync(file.fileno())
            path.replace(self._folder / name)
        except OSError as error:
            raise _unwritten(self._folder / name, error) from None

    def set_aside(self, name: str) -> None:
        """Keep what is whole under another name: the vehicle has something else under this one."""
        path = self._folder / name
        others = (path.with_name(f"{name}.other-{number}") for number in count(1))
        try:
            path.rename(next(other for other in others if not other.exists()))
        except OSError as error:
            raise LogError(
                f"{path}: can't be set aside ({error.strerror}); check the disk and fetch again"
            ) from None

    def drop(self, name: str) -> None:
        """Begin it anew."""
        with contextlib.suppress(OSError):
            (self._folder / (name + PART)).unlink()


def _no_file(path: Path) -> LogError:
    return LogError(f"{path}: is no file; take it away and fetch again")


def _unwritten(path: Path, error: OSError) -> LogError:
    return LogError(f"{path}: can't be written ({error.strerror}); {remedy(error)} and fetch again")


def _unread(path: Path, error: OSError) -> LogError:
    return LogError(f"{path}: can't be read ({error.strerror}); check the disk and fetch again")
