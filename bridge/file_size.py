"""Files that somebody else made: checks their size before they are opened, and reads small files whole."""

import errno
import stat
from pathlib import Path
from typing import Final

ODD: Final = (errno.EINVAL, "no file, but a pipe or a device")
MOST_SMALL_BYTES: Final = 64_000_000
"""Larger than any result, receipt or sidecar file of ours."""

LARGE: Final = (errno.EFBIG, f"more than the {MOST_SMALL_BYTES // 1_000_000} MB that any of ours has")


def size_to_read(path: Path) -> int | None:
    """Return the bytes in a file; None for a pipe or a device, since reading those may never end.

    A folder has a size too, since opening it raises a clear error. Raises OSError if `path` can't be examined.
    """
    state = path.stat()
    return state.st_size if stat.S_ISREG(state.st_mode) or stat.S_ISDIR(state.st_mode) else None


def is_own_file(path: Path) -> bool:
    """Whether `path` is a regular file and no link. Raises OSError if `path` can't be examined."""
    try:
        return stat.S_ISREG(path.lstat().st_mode)
    except FileNotFoundError:
        return False


def check_small(path: Path) -> None:
    """Raise OSError if `path` is a pipe or a device, or is larger than any file of ours."""
    size = size_to_read(path)
    if size is None:
        raise OSError(*ODD, str(path))
    if size > MOST_SMALL_BYTES:
        raise OSError(*LARGE, str(path))


def read_small(path: Path) -> str:
    """Return the text of a file that somebody else may have put there.

    Raises OSError, as `check_small` does, and UnicodeDecodeError.
    """
    check_small(path)
    return path.read_text(encoding="utf-8")
