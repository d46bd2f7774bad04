"""The key that signs a link: 32 bytes in a file that only its owner may read, as one line of 64 hex digits."""

import hashlib
import os
import re
import secrets
import stat
from dataclasses import dataclass, field
from pathlib import Path
from typing import Final

from bridge.errors import ConfigError

KEY_BYTES: Final = 32
OTHERS: Final = stat.S_IRWXG | stat.S_IRWXO
MODE: Final = 0o600
_HEX: Final = re.compile(rb"[0-9a-fA-F]{%d}\s*" % (2 * KEY_BYTES))
_LONGEST: Final = 4096


@dataclass(frozen=True)
class SigningKey:
    """A signing key. Its bytes show in no text that is made of the object."""

    secret: bytes = field(repr=False)

    @property
    def fingerprint(self) -> str:
        """Text that distinguishes the key from others and reveals nothing of it: `3f2a-91bc-04de-77a1`."""
        digest = hashlib.sha256(b"fingerprint of a signing key" + self.secret).hexdigest()
        return "-".join(digest[start : start + 4] for start in range(0, 16, 4))


def of_passphrase(phrase: str) -> SigningKey:
    """Return the key that MAVProxy and QGroundControl derive from a passphrase: its SHA-256."""
    return SigningKey(hashlib.sha256(phrase.encode()).digest())


def new_key() -> SigningKey:
    """Return a random key that nobody can guess."""
    return SigningKey(secrets.token_bytes(KEY_BYTES))


def write_key(path: Path, key: SigningKey) -> None:
    """Write `key` to a new file of mode 0600. Raises ConfigError if the file exists or can't be made."""
    try:
        descriptor = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL, MODE)
    except FileExistsError:
        raise ConfigError(
            f"{path}: exists already, and a key is never overwritten; name another file"
        ) from None
    except OSError as error:
        raise ConfigError(f"{path}: can't be made ({error.strerror}); name another place") from None
    try:
        with os.fdopen(descriptor, "wb") as file:
            os.fchmod(file.fileno(), MODE)
            file.write(key.secret.hex().encode() + b"\n")
            file.flush()
            os.fsync(file.fileno())
    except OSError as error:
        path.unlink(missing_ok=True)
        raise ConfigError(f"{path}: can't be written ({error.strerror}); name another place") from None


def read_key(path: Path) -> SigningKey:
    """Return the key in a file. Raises ConfigError if others may read the file, or if it holds no key."""
    if path.exists() and not path.is_file():
        raise ConfigError(f"{path}: is no file; name the file that holds the key")
    try:
        descriptor = os.open(path, os.O_RDONLY)
    except OSError as error:
        raise ConfigError(
            f"{path}: the key can't be read ({error.strerror}); make one with seatrial keys make {path}"
        ) from None
    with os.fdopen(descriptor, "rb") as file:
        mode = stat.S_IMODE(os.fstat(file.fileno()).st_mode)
        if mode & OTHERS:
            raise ConfigError(
                f"{path}: others can read or change this key (mode {mode:04o}); "
                f"chmod 600 {path}, and make a new key if someone may have read it"
            )
        text = file.read(_LONGEST)
    if not _HEX.fullmatch(text):
        raise ConfigError(
            f"{path}: holds no key, which is one line of {2 * KEY_BYTES} hex digits; "
            "make one with seatrial keys make FILE"
        )
    return SigningKey(bytes.fromhex(text.decode("ascii")))
