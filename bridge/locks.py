"""Locks between programs, on a file or folder: advisory ones of the operating system, which end with their process.

Where the file system has no locks, locking always succeeds.
"""

import fcntl
import os
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path


def try_lock(file: int, *, exclusive: bool = True) -> bool:
    """Lock an open file, `exclusive` or shared, without waiting; return whether the lock is held from now on."""
    try:
        fcntl.flock(file, (fcntl.LOCK_EX if exclusive else fcntl.LOCK_SH) | fcntl.LOCK_NB)
    except BlockingIOError:
        return False
    except OSError:  # this disk has no locks
        return True
    return True


def holder_of(place: Path) -> int | None:
    """The process that holds a lock on a file or folder; None if unknown, as on systems other than Linux."""
    try:
        state = place.stat()
        table = Path("/proc/locks").read_text(encoding="ascii").splitlines()
    except (OSError, UnicodeDecodeError):
        return None
    named = f"{os.major(state.st_dev):02x}:{os.minor(state.st_dev):02x}:{state.st_ino}"
    processes = (
        line.split()[4] for line in table if line.split()[1:2] == ["FLOCK"] and named in line.split()
    )
    return next((int(pid) for pid in processes if pid.isdecimal() and int(pid) > 0), None)


@contextmanager
def held_alone(place: Path) -> Iterator[bool]:
    """Context with the file `place`, which is made, locked; yields whether no other program holds it.

    A folder that can't be written locks nobody out.
    """
    file = -1
    with suppress(OSError):
        place.parent.mkdir(parents=True, exist_ok=True)
        file = os.open(place, os.O_RDWR | os.O_CREAT | os.O_NOFOLLOW, 0o666)
    try:
        yield file < 0 or try_lock(file)
    finally:
        if file >= 0:
            os.close(file)
