"""How much there is to read in a file that somebody else made, before it is opened."""

import stat
from pathlib import Path


def size_to_read(path: Path) -> int | None:
    """Bytes in a file; None for what is none: a pipe would be waited for, and a device read, without an end.

    A folder has a size, as whoever opens it says that it is one. Raises OSError where `path` can't be looked at.
    """
    state = path.stat()
    return state.st_size if stat.S_ISREG(state.st_mode) or stat.S_ISDIR(state.st_mode) else None
