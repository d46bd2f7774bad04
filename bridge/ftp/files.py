"""The files that the server offers: a ring's segments by their names, and nothing else."""

from pathlib import Path
from typing import Protocol

from bridge.file_size import is_own_file
from bridge.ring.segments import segment_named, segments_in


class Files(Protocol):
    """Files in one folder. All methods raise OSError if the disk fails, FileNotFoundError for an unknown name."""

    def sizes(self) -> list[tuple[str, int]]:
        """Name and size in bytes of each file, in order."""
        ...

    def read(self, name: str, offset: int, size: int) -> bytes:
        """Return up to `size` bytes from `offset` on; b"" at the end."""
        ...


class Segments:
    """The segments of a ring in `folder`. Any other name counts as missing, so that no path leads out of it."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder

    def sizes(self) -> list[tuple[str, int]]:
        try:
            return [(segment.name, size) for segment, size in segments_in(self._folder)]
        except FileNotFoundError:  # nothing was kept yet
            return []

    def read(self, name: str, offset: int, size: int) -> bytes:
        path = self._folder / name
        if segment_named(name) is None or not is_own_file(path):
            raise FileNotFoundError(name)
        with path.open("rb", buffering=0) as file:
            file.seek(offset)
            return file.read(size)
