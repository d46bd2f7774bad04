"""One program at a time that reads, changes and writes what lies in a folder: the folder itself is locked, so that no
file is left behind, and the system lets go of it where a process is killed."""

import contextlib
import os
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Final

from gcs_plugin.file_lock import locked

PATIENCE_S: Final = 2.0
"""A change takes milliseconds: who holds the folder for longer hangs, and no note waits for that."""
RETRY_S: Final = 0.005


@contextlib.contextmanager
def alone_in(folder: Path) -> Iterator[None]:
    """While no other program is in it so; where folders can't be locked, or one is held for too long, all the same."""
    held = None
    with contextlib.suppress(OSError):
        held = os.open(folder, os.O_RDONLY)
        _wait_for(held)
    try:
        yield
    finally:
        if held is not None:
            os.close(held)


def _wait_for(held: int) -> None:
    end_s = time.monotonic() + PATIENCE_S
    while not locked(held) and time.monotonic() < end_s:
        time.sleep(RETRY_S)
