"""Reads a part of a ROS 2 bag that its recorder packed as a whole, by way of an unpacked copy that is then removed."""

import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import IO

from bridge.errors import LogError
from identify.ingest.extras import library
from identify.ingest.ros.recorded import EXTRA, ZSTD, CutOff, Message, Reader, Wanted

READ_BYTES = 1 << 22


def of_packed(reader: Reader) -> Reader:
    """The reader of files that `reader` reads once they are unpacked."""

    def read(path: Path, wanted: Wanted) -> Iterator[Message]:
        with tempfile.NamedTemporaryFile() as copy:
            is_whole = _unpack(path, copy)
            copy.flush()
            try:
                yield from reader(Path(copy.name), wanted)
            except LogError as error:
                if not is_whole:
                    raise CutOff from None
                raise LogError(error.reason, path) from None
        if not is_whole:
            raise CutOff

    return read


def _unpack(path: Path, copy: IO[bytes]) -> bool:
    """Unpack a file as far as it is whole; whether it is. Raises LogError if the library is missing."""
    zstd = library(ZSTD, EXTRA, path)
    try:
        with zstd.open(path) as packed:
            while piece := packed.read1(READ_BYTES):
                copy.write(piece)
    except (zstd.ZstdError, EOFError):
        return False
    return True
