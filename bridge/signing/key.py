"""The key that signs a link, and MAVLink 2's signatures made with it.

A key is 32 bytes, in a file that only its owner may read, as one line of 64 hex digits. A signature is thirteen bytes
after a frame's checksum: the link's number, the time in steps of 10 us since 2015 in 6 bytes (little endian), and the
first 6 bytes of SHA-256 over key, header, payload, checksum, link and time (the MAVLink guide).
"""

import hashlib
import hmac
import os
import re
import secrets
import stat
from dataclasses import dataclass, field
from functools import lru_cache
from pathlib import Path
from typing import Final

from fastcrc.crc16 import mcrf4xx

from bridge.errors import ConfigError, FrameError
from bridge.text import typed
from bridge.wire.framing import MAGIC_2, SIGNATURE_BYTES, SIGNED

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
            f"{path}: the key can't be read ({error.strerror}); make one with {typed('seatrial', 'keys', 'make', path)}"
        ) from None
    with os.fdopen(descriptor, "rb") as file:
        mode = stat.S_IMODE(os.fstat(file.fileno()).st_mode)
        if mode & OTHERS:
            raise ConfigError(
                f"{path}: others can read or change this key (mode {mode:04o}); "
                f"{typed('chmod', '600', path)}, and make a new key if someone may have read it"
            )
        text = file.read(_LONGEST)
    if not _HEX.fullmatch(text):
        raise ConfigError(
            f"{path}: holds no key, which is one line of {2 * KEY_BYTES} hex digits; "
            "make one with seatrial keys make FILE"
        )
    return SigningKey(bytes.fromhex(text.decode("ascii")))


FLAGS_AT: Final = 2
HEADER_BYTES: Final = 10
DIGEST_BYTES: Final = 6
TIME_BYTES: Final = 6


def is_signed(raw: bytes) -> bool:
    """Whether a complete frame carries a signature, of any key."""
    return raw[0] == MAGIC_2 and bool(raw[FLAGS_AT] & SIGNED)


def signed(raw: bytes, secret: bytes, link: int, time: int) -> bytes:
    """Return a complete frame signed with `secret` (32 bytes); it replaces a signature that the frame carries.

    link: 0 to 255; time: steps of 10 us since 2015, below 2^48. Raises FrameError for MAVLink 1, which has no room
    for a signature.
    """
    if raw[0] != MAGIC_2:
        raise FrameError("a frame of MAVLink 1 can't be signed; let what sends it speak MAVLink 2")
    stamped = _flagged(unsigned(raw)) + bytes((link,)) + time.to_bytes(TIME_BYTES, "little")
    return stamped + _digest(secret, stamped)


def unsigned(raw: bytes) -> bytes:
    """Return a complete frame without its signature; its checksum stays as right or wrong as it was."""
    return _flagged(raw[:-SIGNATURE_BYTES]) if is_signed(raw) else raw


def is_of(raw: bytes, secret: bytes) -> bool:
    """Whether the signature of a signed frame was made with `secret`."""
    return hmac.compare_digest(_digest(secret, raw[:-DIGEST_BYTES]), raw[-DIGEST_BYTES:])


def link_and_time(raw: bytes) -> tuple[int, int]:
    """Return the link number and the time (steps of 10 us since 2015) in a frame's signature."""
    return raw[-SIGNATURE_BYTES], int.from_bytes(raw[-DIGEST_BYTES - TIME_BYTES : -DIGEST_BYTES], "little")


def _digest(secret: bytes, stamped: bytes) -> bytes:
    return hashlib.sha256(secret + stamped).digest()[:DIGEST_BYTES]


def _flagged(raw: bytes) -> bytes:
    """Return a frame without signature, with its signed flag inverted and its checksum changed accordingly."""
    end = HEADER_BYTES + raw[1]
    checksum = int.from_bytes(raw[end : end + 2], "little") ^ _turned(raw[1])
    flags = bytes((raw[FLAGS_AT] ^ SIGNED,))
    return raw[:FLAGS_AT] + flags + raw[FLAGS_AT + 1 : end] + checksum.to_bytes(2, "little")


@lru_cache(maxsize=256)
def _turned(size: int) -> int:
    """XOR change of the checksum when the signed flag is inverted, for a payload of `size` bytes.

    A CRC is linear: the change depends only on the position of the flag, so that a frame with an unknown id can be
    signed too.
    """
    zeros = bytes(HEADER_BYTES + size)
    return int(mcrf4xx(zeros[: FLAGS_AT - 1] + bytes((SIGNED,)) + zeros[FLAGS_AT:]) ^ mcrf4xx(zeros))
