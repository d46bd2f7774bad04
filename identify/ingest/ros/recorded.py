"""What a bag of any form holds: topics, and the bytes of their messages with the time at which they were recorded.

Each form is read from its first byte on, and not by the index at its end, which a bag lacks whose recorder was killed.
Messages, chunks and whole files that a recorder packed are unpacked here.
"""

import bz2
import sys
import tempfile
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import IO

from bridge.errors import LogError
from identify.ingest.files.optional_libraries import library

RECEIVED, STAMP = "received", "stamp"
"""Columns of each topic: the time of the log, and that in the header of the messages, s."""
EXTRA = "bags"
MOST_UNPACKED_BYTES = 1 << 30
"""The most that one piece of a bag may unpack to; recorders write pieces of 1 to 10 MB."""
ZSTD = "compression.zstd" if sys.version_info >= (3, 14) else "backports.zstd"
ZSTD_MAGIC = b"\x28\xb5\x2f\xfd"


@dataclass(frozen=True)
class Topic:
    """A topic as its recorder announced it.

    encoding: of its messages; `cdr` and `ros1` can be read. language: of `definition`, the fields of its `type`:
    `msg`, `idl`, or empty if the bag holds no definition.
    """

    name: str
    type: str
    encoding: str
    language: str = ""
    definition: str = ""


Message = tuple[Topic, int, bytes]
"""Topic, time of recording in Unix ns, bytes."""
Wanted = Callable[[Topic], bool]
Reader = Callable[[Path, Wanted], Iterator[Message]]
"""Yields the messages of the wanted topics. Raises CutOff once nothing more can be read, LogError if there is nothing
at all."""


class CutOff(Exception):
    """The bag is cut or damaged; all that can be read of it has been."""


def unpacked(data: bytes, packing: str, size: int, path: Path) -> bytes:
    """`data` unpacked, at most `size` bytes; of data that are cut, as much as comes out.

    Raises CutOff for data that are damaged, LogError if the library is missing.
    """
    if packing in ("", "none"):
        return data
    if packing not in ("lz4", "bz2", "zstd"):
        raise LogError(f"is packed as '{packing}', which is not known; unpack it first", path)
    if size > MOST_UNPACKED_BYTES:
        raise CutOff
    damaged: tuple[type[Exception], ...] = (OSError, RuntimeError, EOFError)
    if packing == "lz4":
        unpacker = library("lz4.frame", EXTRA, path).LZ4FrameDecompressor()
    elif packing == "bz2":
        unpacker = bz2.BZ2Decompressor()
    else:
        zstd = library(ZSTD, EXTRA, path)
        unpacker, damaged = zstd.ZstdDecompressor(), (zstd.ZstdError, EOFError)
    try:
        return bytes(unpacker.decompress(data, max_length=size))
    except damaged:
        raise CutOff from None


def unpacked_message(data: bytes, path: Path) -> bytes:
    """A message that its recorder may have packed by itself. Raises CutOff, LogError."""
    if not data.startswith(ZSTD_MAGIC):
        return data
    return unpacked(data, "zstd", MOST_UNPACKED_BYTES, path)


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
