"""Files on the disk: somebody else's are looked at before they are read, ours are written whole or not at all.

Ours are created in other people's folders and never written into an existing entry, above all not a link.
"""

import contextlib
import errno
import os
import stat
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import BinaryIO, Final

from bridge.errors import LogError

ODD: Final = (errno.EINVAL, "no file, but a pipe or a device")
MOST_SMALL_BYTES: Final = 64_000_000
"""Larger than any result, receipt or sidecar file of ours."""

LARGE: Final = (errno.EFBIG, f"more than the {MOST_SMALL_BYTES // 1_000_000} MB that any of ours has")


def state_folder() -> Path:
    """The folder, under the user's home, of all that is kept between two runs."""
    return Path(os.environ.get("XDG_STATE_HOME") or Path.home() / ".local" / "state") / "seatrial"


def settings_folder() -> Path:
    """The folder, under the user's home, of settings that the user writes."""
    return Path(os.environ.get("XDG_CONFIG_HOME") or Path.home() / ".config") / "seatrial"


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


def sync_folder(folder: Path) -> None:
    """Put the entries of the folder on the disk; do nothing if its file system or the operating system can't."""
    with contextlib.suppress(OSError):
        place = os.open(folder, os.O_RDONLY)
        try:
            os.fsync(place)
        finally:
            os.close(place)


PART: Final = ".part"
"""Suffix of a file's name while the file is being written."""

_NO_LINK: Final = getattr(os, "O_NOFOLLOW", 0) | getattr(os, "O_BINARY", 0)
NO_WAIT: Final = getattr(os, "O_NONBLOCK", 0)

_FULL: Final = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG)
_IN_THE_WAY: Final = (errno.EISDIR, errno.ENOTDIR, errno.EEXIST, errno.ENOTEMPTY, errno.ELOOP, errno.ENXIO)


def open_new(path: Path) -> BinaryIO:
    """Create a file for writing; an entry already under its name is removed first. Raises OSError.

    In a folder of somebody else, the name of a partial file may be a link to a file of ours.
    """
    path.unlink(missing_ok=True)
    return open(os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL | _NO_LINK, 0o666), "wb")


@contextmanager
def whole(path: Path) -> Iterator[BinaryIO]:
    """Write a file that then is at `path` complete or not at all; the previous file stays until then.

    Several programs may do so at once, and the last to finish wins. Raises OSError.
    """
    with _in_place_of(path, path.with_name(f"{path.name}.{os.getpid()}{PART}")) as file:
        yield file


def written_ns(path: Path) -> int:
    """Time of a file's last write, ns; 0 if the file is missing."""
    try:
        return path.stat().st_mtime_ns
    except OSError:
        return 0


def write_whole(path: Path, text: str, *, synced: bool = False) -> None:
    """Write a text file as `whole` does; `synced`: on the disk when this returns. Raises OSError.

    What is no character, such as a byte of a file's name that is no UTF-8, becomes a `?`.
    """
    with whole(path) as file:
        file.write(text.encode(errors="replace"))
        if synced:
            to_disk(file)


@contextmanager
def replacing(path: Path, again: str) -> Iterator[BinaryIO]:
    """Like `whole`, but for large files: synced to the disk first, and the partial file has a fixed name.

    The next run thus overwrites what a killed run left. `again` ends the sentence of the LogError that is raised if
    the file can't be written.
    """
    partial = path.with_name(path.name + PART)
    try:
        with _in_place_of(path, partial) as file:
            yield file
            to_disk(file)
    except OSError as error:
        place = partial if partial.is_dir() else path
        raise LogError(f"can't be written ({error.strerror}); {remedy(error)} and {again}", place) from None


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
    """Sync the file to the disk, so that it outlives a power cut from here on. Raises OSError."""
    file.flush()
    os.fsync(file.fileno())


def remedy(error: OSError) -> str:
    """Say what to do if a file can't be written."""
    if error.errno in _FULL:
        return "free disk space"
    if error.errno in _IN_THE_WAY:
        return "take away what lies there"
    if error.errno in (errno.EACCES, errno.EPERM, errno.EROFS):
        return "check the rights of its folder"
    return "check the disk"


def clear_way(path: Path) -> None:
    """Remove a link, a pipe or a device under the name of a result of ours. Raises OSError.

    A path that the user names may go through the user's own link, but an entry in somebody else's dive folder is not
    the user's.
    """
    if os.path.lexists(path) and not is_own_file(path) and not stat.S_ISDIR(path.lstat().st_mode):
        path.unlink()


def open_own(path: Path) -> BinaryIO:
    """Open a file for appending, and create it if it is missing.

    Raises OSError, also for a link, a pipe or a device under its name, which are neither followed nor waited for.
    """
    file = os.open(path, os.O_WRONLY | os.O_APPEND | os.O_CREAT | _NO_LINK | NO_WAIT, 0o666)
    if not stat.S_ISREG(os.fstat(file).st_mode):
        os.close(file)
        raise OSError(errno.EINVAL, os.strerror(errno.EINVAL), str(path))
    return open(file, "ab")
