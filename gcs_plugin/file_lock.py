"""A lock between programs on an open file or folder.

The operating system releases the lock when the file is closed, also when the process is killed. On a disk without
locks, every program gets the lock.
"""

import fcntl


def locked(file: int, *, alone: bool = True) -> bool:
    """Try to lock an open file, `alone` or shared, without waiting; return whether the lock is held from now on."""
    try:
        fcntl.flock(file, (fcntl.LOCK_EX if alone else fcntl.LOCK_SH) | fcntl.LOCK_NB)
    except BlockingIOError:
        return False
    except OSError:  # this disk has no locks
        return True
    return True
