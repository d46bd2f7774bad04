"""Files of ours in a folder of somebody else's: nothing that lay under the name, a link above all, is written to."""

import errno
import os
import stat
from pathlib import Path
from typing import BinaryIO, Final

from bridge.file_size import is_own_file

_NO_LINK: Final = getattr(os, "O_NOFOLLOW", 0) | getattr(os, "O_BINARY", 0)
_NO_WAIT: Final = getattr(os, "O_NONBLOCK", 0)


def open_new(path: Path) -> BinaryIO:
    """Open for writing what was not there before; what was is taken away. Raises OSError.

    A folder of somebody else's may hold a link under the name of a partial file, to a file of ours.
    """
    path.unlink(missing_ok=True)
    return open(os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL | _NO_LINK, 0o666), "wb")


def clear_way(path: Path) -> None:
    """Take away a link, a pipe or a device that lies under the name of a result of ours. Raises OSError.

    What is written where a person says goes through a link of his; what a dive of somebody else's holds is not his.
    """
    if os.path.lexists(path) and not is_own_file(path) and not stat.S_ISDIR(path.lstat().st_mode):
        path.unlink()


def open_own(path: Path) -> BinaryIO:
    """Open for writing at its end a file that may be there already, and is made where it is not.

    Raises OSError, also for a link, a pipe or a device under its name, which are neither followed nor waited for.
    """
    file = os.open(path, os.O_WRONLY | os.O_APPEND | os.O_CREAT | _NO_LINK | _NO_WAIT, 0o666)
    if not stat.S_ISREG(os.fstat(file).st_mode):
        os.close(file)
        raise OSError(errno.EINVAL, os.strerror(errno.EINVAL), str(path))
    return open(file, "ab")
