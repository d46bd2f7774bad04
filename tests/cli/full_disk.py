"""A disk that is full: files below one folder are begun there and take no byte, or none once a set is in force."""

import errno
import io
import os

from bridge import files


class Full(io.BytesIO):
    """A file on such a disk."""

    def write(self, _):
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))


def fill(monkeypatch, folder, ending=""):
    """Let no file below `folder` whose name has that ending take a byte."""
    open_new = files.open_new

    def opened(path):
        made = open_new(path)
        name = path.name.removesuffix(files.PART).removesuffix(f".{os.getpid()}")
        if not path.absolute().is_relative_to(folder.absolute()):
            return made
        if not name.endswith(ending):
            return made
        made.close()
        return Full()

    monkeypatch.setattr(files, "open_new", opened)


def full_once_in_force(vehicle, monkeypatch):
    """The disk is full from the moment on at which a set came into force."""
    fsync = os.fsync

    def full(file):
        if any(vehicle.server.active(1).values()):
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        fsync(file)

    monkeypatch.setattr("os.fsync", full)
