"""Lock of a folder for a read-change-write by a single program at a time.

The folder itself is locked, so that no lock file is left behind, and the operating system releases the lock when its
process is killed.
"""

import contextlib
import os
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Final

from gcs_plugin.file_lock import locked

PATIENCE_S: Final = 2.0
"""A change takes milliseconds: a program that holds the folder for longer hangs, and no note waits for that."""
RETRY_S: Final = 0.005


@contextlib.contextmanager
def alone_in(folder: Path) -> Iterator[None]:
    """Context with the folder locked; without the lock if folders can't be locked or PATIENCE_S have passed."""
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
