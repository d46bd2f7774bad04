"""`seal`: writes dives with hidden effects into a folder, with locked answers and a hash to publish beforehand.

    FOLDER/case_001/dive.tlog     the dive to diagnose
    FOLDER/case_001/check.tlog    another mission of the same vehicle with the same hidden effects
    FOLDER/case_001/vehicle.yaml  the crew's vehicle file
    FOLDER/answers.sealed         the answers as JSON, locked
    FOLDER.key                    key to the answers, for its owner only: keep it from those who are judged
    FOLDER.sha256                 hash of answers.sealed, also printed: publish it before anything is diagnosed

Anyone who knows the seed can make the answers again: keep it from those who are judged.
"""

import hashlib
import json
import os
import shutil
from collections.abc import Callable, Sequence
from contextlib import ExitStack
from itertools import count
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from bridge.errors import LogError
from bridge.files import PART, check_small, read_small, write_whole
from identify.challenge.case import Case, check_of, dive_of, draw_case
from identify.challenge.tlog import tlog_of

PRIVATE = 0o600
"""File mode of a key: only its owner may read it."""


def locked(data: bytes, key: str) -> bytes:
    """Encrypt data under a key by XOR with a stream of hashes. Called again with that key, it decrypts."""
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


ANSWERS = "answers.sealed"
SEEDS = 10_000
"""Upper limit of cases per seed, so that two seeds share no case."""


def seal(
    folder: Path,
    cases: int,
    seed: int,
    key: str,
    progress: Callable[[float, str], None],
    without: Sequence[str] = (),
) -> str:
    """Make `cases` cases of a seed in a new folder, lock the answers under a key, and return their SHA-256 when locked.

    Effects in `without` are hidden only as unknown effects: the diagnosing library leaves them out.

    What fails or is interrupted leaves none of the three. Raises LogError if the folder, its key or its hash exists
    already or can't be written.
    """
    if not 1 <= cases < SEEDS:
        raise LogError(f"{cases} cases can't be sealed; ask for 1 to {SEEDS - 1}")
    truths: list[dict[str, Any]] = []
    for path in (folder, key_path(folder), hash_path(folder)):
        if path.exists():
            raise LogError(f"{path}: exists already and is never overwritten; name another folder")
    try:
        folder.parent.mkdir(parents=True, exist_ok=True)
        temporary = TemporaryDirectory(dir=folder.parent, prefix=f"{folder.name}.", suffix=PART)
        with temporary as place, ExitStack() as undo:
            partial = Path(place) / "cases"
            partial.mkdir()
            for number in range(1, cases + 1):
                case = draw_case(seed * SEEDS + number, name=f"case_{number:03d}", without=without)
                _write(partial / case.name, case)
                truths.append(case.truth())
                progress(number / cases, f"sealing {case.name}")
            sealed = {"version": 2, "seed": seed, "without": list(without), "cases": truths}
            data = locked((json.dumps(sealed, allow_nan=False) + "\n").encode(), key)
            digest = hashlib.sha256(data).hexdigest()
            (partial / ANSWERS).write_bytes(data)
            partial.rename(folder)
            undo.callback(shutil.rmtree, folder, ignore_errors=True)
            write_key(key_path(folder), key)
            undo.callback(key_path(folder).unlink)
            write_whole(hash_path(folder), f"{digest}  {folder.name}/{ANSWERS}\n")
            undo.pop_all()
    except OSError as error:
        raise LogError(f"{folder}: can't be written ({error.strerror}); name another folder") from None
    return digest


def _write(folder: Path, case: Case) -> None:
    folder.mkdir()
    (folder / "vehicle.yaml").write_text(case.vehicle.text, encoding="utf-8")
    (folder / "dive.tlog").write_bytes(tlog_of(dive_of(case)))
    (folder / "check.tlog").write_bytes(tlog_of(check_of(case)))


def key_path(folder: Path) -> Path:
    """Path of the key to a sealed folder: next to the folder, never in it."""
    return _next_to(folder, ".key")


def hash_path(folder: Path) -> Path:
    """Path of the hash of a sealed folder's locked answers."""
    return _next_to(folder, ".sha256")


def _next_to(folder: Path, ending: str) -> Path:
    """A file named after a folder that is given by its name or, from within it, as `.` or `..`."""
    named = folder.resolve() if folder.name in ("", "..") else folder
    return named.with_name(f"{named.name}{ending}")


def unsealed(folder: Path, published: str | None = None, key: Path | None = None) -> list[dict[str, Any]]:
    """Truths of a sealed folder, after a check that the hash of its answers is that `published`.

    Without `published`, the hash file next to the folder is used. key: the key file; by default the one next to the
    folder.

    Raises LogError if the hash differs, or if the answers can't be read.
    """
    try:
        check_small(folder / ANSWERS)
        data = (folder / ANSWERS).read_bytes()
        known = published or read_small(hash_path(folder)).split(maxsplit=1)[0]
    except (OSError, UnicodeDecodeError, IndexError):
        raise LogError(
            f"{folder}: holds no {ANSWERS}, or {hash_path(folder).name} is not beside it; give a folder of challenge "
            "seal, and the hash that was published with --hash"
        ) from None
    digest = hashlib.sha256(data).hexdigest()
    if known.lower() != digest:
        raise LogError(
            f"{folder / ANSWERS}: its SHA-256 is {digest}, and {known} was published: the answers were changed after "
            "sealing, so nothing is scored; seal anew"
        )
    file = key or key_path(folder)
    try:
        truths: list[dict[str, Any]] = json.loads(locked(data, read_key(file)))["cases"]
    except (ValueError, KeyError, TypeError):
        raise LogError(
            f"{file}: does not open {folder / ANSWERS}; give the key that was written with it"
        ) from None
    return truths
