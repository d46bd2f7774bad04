"""The names in a folder, put on the disk: else a loss of power may take a new file, though its bytes are there."""

import contextlib
import os
from pathlib import Path


def sync_folder(folder: Path) -> None:
    """Put the names in it on the disk; nothing where its file system, or the operating system, can't."""
    with contextlib.suppress(OSError):
        place = os.open(folder, os.O_RDONLY)
        try:
            os.fsync(place)
        finally:
            os.close(place)
