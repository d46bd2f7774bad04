"""A lock between programs, on a file or folder that is open: the system lets go of it as that is closed, also where a
process is killed. Where the disk knows no locks, everybody has it."""

import fcntl


def locked(file: int, *, alone: bool = True) -> bool:
    """Whether it is held from now on: by nobody else, or together with all who do not want it `alone`."""
    try:
        fcntl.flock(file, (fcntl.LOCK_EX if alone else fcntl.LOCK_SH) | fcntl.LOCK_NB)
    except BlockingIOError:
        return False
    except OSError:  # this disk knows no locks
        return True
    return True
