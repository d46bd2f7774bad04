"""A file that is still written while somebody deletes it, or moves it away with its folder.

The system says nothing of it: each write goes well, and a deleted file is gone once it is closed.
"""

import contextlib
import os
from pathlib import Path
from typing import Final

from bridge.errors import TakenAway

COPIED_BYTES: Final = 1 << 20
DELETED_ONCE_CLOSED: Final = (".nfs", ".fuse_hidden")
"""How network disks rename what was deleted while it is open."""


def see(file: int, path: Path) -> None:
    """Raises TakenAway where the open `file` lies no more at `path`, OSError where that can't be told."""
    here, place = os.fstat(file), _place(file)
    with contextlib.suppress(FileNotFoundError, NotADirectoryError):
        there = path.stat()
        if os.path.samestat(here, there):
            return
        # Some network disks number a file anew at each look.
        if there.st_dev == here.st_dev and place == os.path.realpath(path):
            return
    deleted = here.st_nlink == 0 or os.path.basename(place).startswith(DELETED_ONCE_CLOSED)
    raise TakenAway(path, None if deleted else place)


def write_again(file: int, path: Path) -> int:
    """What the open `file` holds, in a new one at `path`, returned open. Raises OSError, and leaves nothing then."""
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
    """Where a file is now, as far as the system tells; "elsewhere" where it does not."""
    try:
        place = os.readlink(f"/proc/self/fd/{file}")
    except OSError:
        return "elsewhere"
    return place if os.path.exists(place) else "elsewhere"
