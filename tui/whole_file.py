"""Write a file completely or not at all."""

import os
from pathlib import Path

from bridge.new_file import to_disk, whole


def replace_file(path: Path, text: str) -> None:
    """Write `text` to `path`; if that fails, a file that was there stays unchanged. Raises OSError.

    A path that is no plain file, such as a pipe, or whose folder takes no new file, is written in place.
    """
    path = path.resolve()
    if (path.exists() and not path.is_file()) or not os.access(path.parent, os.W_OK):
        path.write_text(text, encoding="utf-8")
        return
    with whole(path) as file:
        file.write(text.encode())
        to_disk(file)
