"""A disk that is full: files below one folder are begun there and take no byte."""

import errno
import io
import os

from bridge import new_file


class Full(io.BytesIO):
    """A file on such a disk."""

    def write(self, _):
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))


def fill(monkeypatch, folder, ending=""):
    """Let no file below `folder` whose name has that ending take a byte."""
    open_new = new_file.open_new

    def opened(path):
        made = open_new(path)
        name = path.name.removesuffix(new_file.PART).removesuffix(f".{os.getpid()}")
        if not path.absolute().is_relative_to(folder.absolute()):
            return made
        if not name.endswith(ending):
            return made
        made.close()
        return Full()

    monkeypatch.setattr(new_file, "open_new", opened)
