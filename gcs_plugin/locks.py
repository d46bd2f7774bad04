"""Locks between programs: on a folder that is changed, a dive that is merged, a recording that is written.

They are advisory locks of the operating system on the file or folder itself: nothing is left behind, and they end with
their process. Where the file system has no locks, locking always succeeds.
"""

import contextlib
import os
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Final

from bridge.errors import LogError
from bridge.files import NO_WAIT
from bridge.locks import holder_of, try_lock
from bridge.wire.tlog import TlogWriter

CHANGE_S: Final = 2.0
"""Longest wait for a change of a folder, which takes milliseconds: a program that holds it for longer hangs."""
RETRY_S: Final = 0.005
MERGE_S: Final = 10.0
"""Longest wait for another merge of the same dive."""
LOOK_EVERY_S: Final = 0.1


def _lock_within(file: int, longest_s: float, every_s: float) -> bool:
    """Lock an open file as soon as nobody else holds it; return whether that was within `longest_s`."""
    end_s = time.monotonic() + longest_s
    while not (is_held := try_lock(file)) and time.monotonic() < end_s:
        time.sleep(every_s)
    return is_held


@contextlib.contextmanager
def folder_lock(folder: Path) -> Iterator[None]:
    """Context with the folder locked; without the lock if folders can't be locked or CHANGE_S have passed."""
    held = None
    with contextlib.suppress(OSError):
        held = os.open(folder, os.O_RDONLY)
        _lock_within(held, CHANGE_S, RETRY_S)
    try:
        yield
    finally:
        if held is not None:
            os.close(held)


class LockedTlogWriter(TlogWriter):
    """A recording that is locked until it is closed, so that other programs see that it is still being written."""

    def __init__(self, path: Path) -> None:
        self._lock, self._is_held = -1, False
        super().__init__(path)
        self._hold()

    def sync(self) -> None:
        super().sync()
        self._hold()

    def close(self) -> None:
        lock, self._lock, self._is_held = self._lock, -1, False
        try:
            super().close()
        finally:
            if lock >= 0:
                os.close(lock)

    def _hold(self) -> None:
        """Lock the file now, or with the next `sync`: a program that checks it just now holds the lock for a moment."""
        if self._is_held:
            return
        with contextlib.suppress(OSError):
            if self._lock < 0:
                self._lock = os.open(self.path, os.O_RDWR | NO_WAIT)
            self._is_held = try_lock(self._lock)


def is_being_written(recording: Path) -> bool:
    """Whether a recorder is still writing this file."""
    try:
        if not recording.is_file():
            return False
        file = os.open(recording, os.O_RDONLY | NO_WAIT)
    except OSError:
        return False
    try:
        return not try_lock(file, exclusive=False)
    finally:
        os.close(file)


@contextlib.contextmanager
def merge_lock(folder: Path, again: str) -> Iterator[None]:
    """Context with the exclusive right to merge the recordings of a dive.

    Raises LogError if the folder can't be read, or if another merge still runs after MERGE_S; `again` ends its
    message: how to try again.
    """
    try:
        opened = os.open(folder, os.O_RDONLY)
    except OSError as error:
        raise LogError(f"can't be read ({error.strerror}); check its rights and {again}", folder) from None
    try:
        if not _lock_within(opened, MERGE_S, LOOK_EVERY_S):
            process = holder_of(folder)
            by = f"another merge or fetch{f' (process {process})' if process else ''}"
            raise LogError(f"{by} puts recordings of it together; wait for its end and {again}", folder)
        yield
    finally:
        os.close(opened)
