"""Files of ours in a folder of somebody else's: nothing that lay under the name, a link above all, is written to."""

import errno
import os
import stat
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import BinaryIO, Final

from bridge.errors import LogError
from bridge.file_size import is_own_file

PART: Final = ".part"
"""What a name ends with while its file is written."""

_NO_LINK: Final = getattr(os, "O_NOFOLLOW", 0) | getattr(os, "O_BINARY", 0)
_NO_WAIT: Final = getattr(os, "O_NONBLOCK", 0)

_FULL: Final = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG)
_IN_THE_WAY: Final = (errno.EISDIR, errno.ENOTDIR, errno.EEXIST, errno.ENOTEMPTY, errno.ELOOP, errno.ENXIO)


def open_new(path: Path) -> BinaryIO:
    """Open for writing what was not there before; what was is taken away. Raises OSError.

    A folder of somebody else's may hold a link under the name of a partial file, to a file of ours.
    """
    path.unlink(missing_ok=True)
    return open(os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL | _NO_LINK, 0o666), "wb")


@contextmanager
def whole(path: Path) -> Iterator[BinaryIO]:
    """A file to write that then stands at `path`, whole or not at all; what was there stays till then.

    Several programs may do so at once, and the last one's stands. Raises OSError.
    """
    with _in_place_of(path, path.with_name(f"{path.name}.{os.getpid()}{PART}")) as file:
        yield file


@contextmanager
def replacing(path: Path, again: str) -> Iterator[BinaryIO]:
    """As `whole`, on the disk before it stands, and for what is large: the next one writes over what a kill left.

    `again` ends the sentence of the LogError that is raised where it can't be written.
    """
    partial = path.with_name(path.name + PART)
    try:
        with _in_place_of(path, partial) as file:
            yield file
            to_disk(file)
    except OSError as error:
        place = partial if partial.is_dir() else path
        raise LogError(f"{place}: can't be written ({error.strerror}); {remedy(error)} and {again}") from None


@contextmanager
def _in_place_of(path: Path, partial: Path) -> Iterator[BinaryIO]:
    try:
        with open_new(partial) as file:
            yield file
        partial.replace(path)
    except OSError:
        with suppress(OSError):
            partial.unlink(missing_ok=True)
        raise


def to_disk(file: BinaryIO) -> None:
    """What was written outlives a power cut from here on. Raises OSError."""
    file.flush()
    os.fsync(file.fileno())


def remedy(error: OSError) -> str:
    """What to do where a file can't be written."""
    if error.errno in _FULL:
        return "free disk space"
    if error.errno in _IN_THE_WAY:
        return "take away what lies there"
    if error.errno in (errno.EACCES, errno.EPERM, errno.EROFS):
        return "check the rights of its folder"
    return "check the disk"


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
