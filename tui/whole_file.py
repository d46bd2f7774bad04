"""A file that is written whole or not at all."""

import os
from pathlib import Path

from bridge.new_file import to_disk, whole


def replace_file(path: Path, text: str) -> None:
    """Put `text` where `path` is; where that fails, what lay there stays as it was. Raises OSError.

    What is no plain file, as a pipe, and what lies in a folder that takes no new file, is written in its place.
    """
    path = path.resolve()
    if (path.exists() and not path.is_file()) or not os.access(path.parent, os.W_OK):
        path.write_text(text, encoding="utf-8")
        return
    with whole(path) as file:
        file.write(text.encode())
        to_disk(file)
