"""Handles a file that somebody deletes, or moves with its folder, while it is still being written.

The system does not report it: each write succeeds, and a deleted file is gone once it is closed.
"""

import contextlib
import os
from pathlib import Path
from typing import Final

from bridge.errors import TakenAway

COPIED_BYTES: Final = 1 << 20
DELETED_ONCE_CLOSED: Final = (".nfs", ".fuse_hidden")
"""Prefixes to which network disks rename a file that is deleted while open."""


def see(file: int, path: Path) -> None:
    """Raise TakenAway if the open `file` is no longer at `path`, OSError if that can't be determined."""
    here, place = os.fstat(file), _place(file)
    with contextlib.suppress(FileNotFoundError, NotADirectoryError):
        there = path.stat()
        if os.path.samestat(here, there):
            return
        # Some network disks give a file a new number each time it is examined.
        if there.st_dev == here.st_dev and place == os.path.realpath(path):
            return
    deleted = here.st_nlink == 0 or os.path.basename(place).startswith(DELETED_ONCE_CLOSED)
    raise TakenAway(path, None if deleted else place)


def write_again(file: int, path: Path) -> int:
    """Copy the open `file` to a new file at `path` and return that, open. Raises OSError, and then leaves no file."""
    path.parent.mkdir(parents=True, exist_ok=True)
    new = os.open(path, os.O_RDWR | os.O_CREAT | os.O_EXCL, 0o644)
    try:
        at = 0
        while piece := os.pread(file, COPIED_BYTES, at):
            at += os.write(new, piece)
        os.fsync(new)
    except OSError:
        os.close(new)
        with contextlib.suppress(OSError):
            path.unlink()
        raise
    return new


def _place(file: int) -> str:
    """Current path of an open file as far as the system reports it, otherwise "elsewhere"."""
    try:
        place = os.readlink(f"/proc/self/fd/{file}")
    except OSError:
        return "elsewhere"
    return place if os.path.exists(place) else "elsewhere"
