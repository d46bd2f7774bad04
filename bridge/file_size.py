"""Files that somebody else made: how much there is to read in one, before it is opened; small ones read whole."""

import errno
import stat
from pathlib import Path
from typing import Final

ODD: Final = (errno.EINVAL, "no file, but a pipe or a device")
MOST_SMALL_BYTES: Final = 64_000_000
"""More than any result, receipt or sidecar of ours has."""

LARGE: Final = (errno.EFBIG, f"more than the {MOST_SMALL_BYTES // 1_000_000} MB that any of ours has")


def size_to_read(path: Path) -> int | None:
    """Bytes in a file; None for what is none: a pipe would be waited for, and a device read, without an end.

    A folder has a size, as whoever opens it says that it is one. Raises OSError where `path` can't be looked at.
    """
    state = path.stat()
    return state.st_size if stat.S_ISREG(state.st_mode) or stat.S_ISDIR(state.st_mode) else None


def is_own_file(path: Path) -> bool:
    """Whether a file lies there, and no link to one elsewhere. Raises OSError where `path` can't be looked at."""
    try:
        return stat.S_ISREG(path.lstat().st_mode)
    except FileNotFoundError:
        return False


def check_small(path: Path) -> None:
    """Raise OSError for what is no file, and for one that is larger than any of ours."""
    size = size_to_read(path)
    if size is None:
        raise OSError(*ODD, str(path))
    if size > MOST_SMALL_BYTES:
        raise OSError(*LARGE, str(path))


def read_small(path: Path) -> str:
    """The text of a file that somebody may have put there. Raises OSError, as `check_small` does, and
    UnicodeDecodeError."""
    check_small(path)
    return path.read_text(encoding="utf-8")
