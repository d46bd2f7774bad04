"""Locks that show which recordings are still being written, and which dives are being merged.

They are locks of the operating system, released when their process ends. They are advisory: a program that does not ask
is not stopped. On a disk without locks, nothing appears to be in use.
"""

import contextlib
import os
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Final

from bridge.errors import LogError
from bridge.tlog import TlogWriter
from gcs_plugin.file_lock import locked

LOOK_EVERY_S: Final = 0.1
PATIENCE_S: Final = 10.0
"""How long to wait for another merge of the same dive."""
_NO_WAIT: Final = getattr(os, "O_NONBLOCK", 0)


class HeldTlog(TlogWriter):
    """A recording that is locked until it is closed, so that other programs see that it is still being written."""

    def __init__(self, path: Path) -> None:
        self._lock, self._is_held = -1, False
        super().__init__(path)
        self._hold()

    def sync(self) -> None:
        super().sync()
        self._hold()

    def close(self) -> None:
        super().close()
        if self._lock >= 0:
            os.close(self._lock)
        self._lock, self._is_held = -1, False

    def _hold(self) -> None:
        """Lock the file now, or with the next `sync`: a program that checks it just now holds the lock for a moment."""
        if self._is_held:
            return
        with contextlib.suppress(OSError):
            if self._lock < 0:
                self._lock = os.open(self.path, os.O_RDWR | _NO_WAIT)
            self._is_held = locked(self._lock)


def is_written(recording: Path) -> bool:
    """Whether a recorder is still writing this file."""
    try:
        if not recording.is_file():
            return False
        file = os.open(recording, os.O_RDONLY | _NO_WAIT)
    except OSError:
        return False
    try:
        return not locked(file, alone=False)
    finally:
        os.close(file)


@contextlib.contextmanager
def alone_at(folder: Path, again: str, wait: Callable[[float], None] = time.sleep) -> Iterator[None]:
    """Context with the exclusive right to merge the recordings of a dive.

    Raises LogError if the folder can't be read, or if another merge still runs after PATIENCE_S; `again` ends its
    message: how to try again.
    """
    try:
        opened = os.open(folder, os.O_RDONLY)
    except OSError as error:
        raise LogError(f"{folder}: can't be read ({error.strerror}); check its rights and {again}") from None
    try:
        looks = round(PATIENCE_S / LOOK_EVERY_S)
        while not (had := locked(opened)) and looks > 0:
            looks -= 1
            wait(LOOK_EVERY_S)
        if not had:
            raise LogError(
                f"{folder}: {_by(folder)} puts recordings of it together; wait for its end and {again}"
            )
        yield
    finally:
        os.close(opened)


def _by(place: Path) -> str:
    process = holder_of(place)
    return f"another merge or fetch (process {process})" if process else "another merge or fetch"


def holder_of(place: Path) -> int | None:
    """The process that holds a lock on a file or folder; None if unknown, as on systems other than Linux."""
    try:
        state = place.stat()
        table = Path("/proc/locks").read_text(encoding="ascii").splitlines()
    except (OSError, UnicodeDecodeError):
        return None
    named = f"{os.major(state.st_dev):02x}:{os.minor(state.st_dev):02x}:{state.st_ino}"
    processes = (
        line.split()[4] for line in table if line.split()[1:2] == ["FLOCK"] and named in line.split()
    )
    return next((int(pid) for pid in processes if pid.isdecimal() and int(pid) > 0), None)
