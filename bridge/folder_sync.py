"""Puts a folder's entries on the disk: otherwise a power loss may lose a new file although its bytes are there."""

import contextlib
import os
from pathlib import Path


def sync_folder(folder: Path) -> None:
    """Put the entries of the folder on the disk; do nothing if its file system or the operating system can't."""
    with contextlib.suppress(OSError):
        place = os.open(folder, os.O_RDONLY)
        try:
            os.fsync(place)
        finally:
            os.close(place)
