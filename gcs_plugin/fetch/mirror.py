"""What the ground has of vehicles' rings: each segment under its own name, so that no byte is fetched twice.

A segment that is not whole yet is a `.part`: the beginning of it, without a hole, whenever the program ends. A
`.other-N` was whole under a name under which the vehicle now has something else.
"""

import contextlib
import fcntl
import os
import shutil
from collections.abc import Iterator
from itertools import count
from pathlib import Path
from typing import Final

from bridge.errors import LogError
from bridge.ftp.server import crc32

PART: Final = ".part"
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
        path = self._folder / LOCK
        try:
            self._folder.mkdir(parents=True, exist_ok=True)
            file = os.open(path, os.O_WRONLY | os.O_CREAT, 0o644)
        except OSError as error:
            raise LogError(
                f"{path}: can't be written ({error.strerror}); free disk space and fetch again"
            ) from None
        try:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
            yield
        except BlockingIOError:
            raise LogError(
                f"{self._folder}: another fetch is at work there; wait for its end, then fetch again"
            ) from None
        finally:
            os.close(file)

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
        whole = self._folder / name
        return whole if whole.exists() else self._folder / (name + PART)

    def size(self, name: str) -> int:
        """How many of its first bytes are there."""
        try:
            return self.path(name).stat().st_size
        except FileNotFoundError:
            return 0

    def is_whole(self, name: str) -> bool:
        """Whether all of it is there, and its checksum was right."""
        return (self._folder / name).exists()

    def append(self, name: str, data: bytes) -> None:
        """The next bytes of it."""
        path = self._folder / (name + PART)
        try:
            self._folder.mkdir(parents=True, exist_ok=True)
            # A folder of somebody else's may hold a link under that name, to a file of ours.
            flags = os.O_WRONLY | os.O_APPEND | os.O_CREAT | getattr(os, "O_NOFOLLOW", 0)
            with open(os.open(path, flags, 0o666), "ab") as file:
                file.write(data)
        except OSError as error:
            raise LogError(
                f"{path}: can't be written ({error.strerror}); free disk space and fetch again"
            ) from None

    def checksum(self, name: str) -> int:
        """MAVLink FTP's, of what there is."""
        crc = 0
        with contextlib.suppress(FileNotFoundError), self.path(name).open("rb") as file:
            while data := file.read(PIECE_BYTES):
                crc = crc32(data, crc)
        return crc

    def tail(self, name: str, size: int) -> bytes:
        """The last bytes of what there is. Raises LogError where it can't be read."""
        path = self.path(name)
        try:
            with path.open("rb") as file:
                file.seek(-size, os.SEEK_END)
                return file.read()
        except OSError as error:
            raise LogError(
                f"{path}: can't be read ({error.strerror}); check the disk and fetch again"
            ) from None

    def finish(self, name: str) -> None:
        """It is whole."""
        path = self._folder / (name + PART)
        try:
            self._folder.mkdir(parents=True, exist_ok=True)
            # Of one that was begun and holds nothing there is no file yet.
            with path.open("ab") as file:
                os.fsync(file.fileno())
            path.replace(self._folder / name)
        except OSError as error:
            raise LogError(
                f"{path}: can't be kept ({error.strerror}); check the disk and fetch again"
            ) from None

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
