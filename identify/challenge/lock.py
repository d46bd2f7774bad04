"""Hides answers under a key that is kept elsewhere, so that nobody reads them by accident. Not a cipher for secrets.

The bytes are XORed with SHA-256 of the key and a counter. Without the key nothing can be read; any change shows in
the hash of the whole file, which is published beforehand.
"""

import hashlib
import os
from itertools import count
from pathlib import Path

from bridge.errors import LogError
from bridge.file_size import read_small

PRIVATE = 0o600
"""File mode of a key: only its owner may read it."""


def locked(data: bytes, key: str) -> bytes:
    """Encrypt data under a key; a second call decrypts it."""
    stream = bytearray()
    for number in count():
        if len(stream) >= len(data):
            break
        stream += hashlib.sha256(f"{key} {number}".encode()).digest()
    return bytes(a ^ b for a, b in zip(data, stream, strict=False))


def write_key(path: Path, key: str) -> None:
    """Write a new key file that only its owner may read. Raises FileExistsError if the file exists, or OSError."""
    with os.fdopen(os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL, PRIVATE), "w") as file:
        file.write(f"{key}\n")


def read_key(path: Path) -> str:
    """Read a key. Raises LogError if the file holds none."""
    try:
        return read_small(path).strip()
    except (OSError, UnicodeDecodeError):
        raise LogError(
            f"{path}: holds no key; give the file that challenge seal wrote with --key FILE"
        ) from None
