"""A file that is made anew: nothing that lay under its name, a link above all, is written through."""

import os
from pathlib import Path
from typing import BinaryIO


def open_new(path: Path) -> BinaryIO:
    """Open for writing what was not there before; what was is taken away. Raises OSError.

    A folder of somebody else's may hold a link under the name of a partial file, to a file of ours.
    """
    path.unlink(missing_ok=True)
    flags = os.O_WRONLY | os.O_CREAT | os.O_EXCL | getattr(os, "O_NOFOLLOW", 0) | getattr(os, "O_BINARY", 0)
    return open(os.open(path, flags, 0o666), "wb")
