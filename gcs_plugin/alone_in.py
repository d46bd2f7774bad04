"""One program at a time that reads, changes and writes what lies in a folder: the folder itself is locked, so that no
file is left behind, and the system lets go of it where a process is killed."""

import contextlib
import fcntl
import os
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Final

PATIENCE_S: Final = 2.0
"""A change takes milliseconds: who holds the folder for longer hangs, and no note waits for that."""
RETRY_S: Final = 0.005


@contextlib.contextmanager
def alone_in(folder: Path) -> Iterator[None]:
    """While no other program is in it so; where folders can't be locked, or one is held for too long, all the same."""
    held = None
    with contextlib.suppress(OSError):
        held = os.open(folder, os.O_RDONLY)
        _lock(held)
    try:
        yield
    finally:
        if held is not None:
            os.close(held)


def _lock(held: int) -> None:
    end_s = time.monotonic() + PATIENCE_S
    while True:
        try:
            fcntl.flock(held, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            if time.monotonic() >= end_s:
                return
            time.sleep(RETRY_S)
        else:
            return
