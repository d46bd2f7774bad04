"""Answers that nobody reads by accident: hidden under a key that lies elsewhere. No cipher to keep a secret by.

The bytes are combined (exclusive or) with SHA-256 of the key and a counter: without the key nothing can be
read, and any change is seen by the hash of the whole, which is published before.
"""

import hashlib
import os
from itertools import count
from pathlib import Path

from bridge.errors import LogError
from bridge.file_size import read_small

PRIVATE = 0o600
"""Its owner alone may read a key."""


def locked(data: bytes, key: str) -> bytes:
    """Data under a key; the same once more opens it."""
    stream = bytearray()
    for number in count():
        if len(stream) >= len(data):
            break
        stream += hashlib.sha256(f"{key} {number}".encode()).digest()
    return bytes(a ^ b for a, b in zip(data, stream, strict=False))


def write_key(path: Path, key: str) -> None:
    """A new file that its owner alone may read. Raises FileExistsError where it is there already, or OSError."""
    with os.fdopen(os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL, PRIVATE), "w") as file:
        file.write(f"{key}\n")


def read_key(path: Path) -> str:
    """Raises LogError where there is none."""
    try:
        return read_small(path).strip()
    except (OSError, UnicodeDecodeError):
        raise LogError(
            f"{path}: holds no key; give the file that challenge seal wrote with --key FILE"
        ) from None
