"""`seal`: dives with hidden effects in a folder, their answers locked beside them, and a hash that was there before.

    FOLDER/case_001/dive.tlog     to diagnose
    FOLDER/case_001/check.tlog    another mission of the same vehicle, with what was there still there
    FOLDER/case_001/vehicle.yaml  what its crew knows
    FOLDER/answers.sealed         JSON, locked
    FOLDER.key                    what opens them, for their owner's eyes alone: keep it from who is judged
    FOLDER.sha256                 of answers.sealed, also printed: to be published before anything is diagnosed

Who knows the seed can make the answers again: keep it from those who are judged.
"""

import hashlib
import json
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from bridge.errors import LogError
from bridge.file_size import check_small, read_small
from identify.challenge.case import Case, check_of, dive_of, draw_case
from identify.challenge.lock import locked, read_key, write_key
from identify.challenge.recording import tlog_of

ANSWERS = "answers.sealed"
SEEDS = 10_000
"""Cases to a seed at most, so that two seeds share none."""


def case_name(number: int) -> str:
    return f"case_{number:03d}"


def seal(
    folder: Path,
    cases: int,
    seed: int,
    key: str,
    progress: Callable[[float, str], None],
    without: Sequence[str] = (),
) -> str:
    """Make `cases` cases of a seed in a new folder, the answers under a key; gives the SHA-256 of the locked answers.

    What `without` names is hidden as something unknown, and nowhere else: who diagnoses leaves it out of the library.

    Raises LogError where the folder, its key or its hash exists or can't be written.
    """
    if not 1 <= cases < SEEDS:
        raise LogError(f"{cases} cases can't be sealed; ask for 1 to {SEEDS - 1}")
    truths: list[dict[str, Any]] = []
    for beside in (key_path(folder), hash_path(folder)):
        if beside.exists():
            raise LogError(f"{beside}: exists already and is never overwritten; name another folder")
    try:
        folder.mkdir(parents=True)
        write_key(key_path(folder), key)
        for number in range(1, cases + 1):
            case = draw_case(seed * SEEDS + number, name=case_name(number), without=without)
            _write(folder / case.name, case)
            truths.append(case.truth())
            progress(number / cases, f"sealing {case.name}")
        sealed = {"version": 2, "seed": seed, "without": list(without), "cases": truths}
        data = locked((json.dumps(sealed, allow_nan=False) + "\n").encode(), key)
        digest = hashlib.sha256(data).hexdigest()
        hash_path(folder).write_text(f"{digest}  {folder.name}/{ANSWERS}\n", encoding="utf-8")
        (folder / ANSWERS).write_bytes(data)
    except FileExistsError:
        raise LogError(f"{folder}: exists already and is never overwritten; name another folder") from None
    except OSError as error:
        raise LogError(f"{folder}: can't be written ({error.strerror}); name another folder") from None
    return digest


def _write(folder: Path, case: Case) -> None:
    folder.mkdir()
    (folder / "vehicle.yaml").write_text(case.vehicle.text, encoding="utf-8")
    (folder / "dive.tlog").write_bytes(tlog_of(dive_of(case)))
    (folder / "check.tlog").write_bytes(tlog_of(check_of(case)))


def key_path(folder: Path) -> Path:
    """Where the key to a sealed folder lies: beside it, never in it."""
    return folder.with_name(f"{folder.name}.key")


def hash_path(folder: Path) -> Path:
    """Where the hash of its locked answers lies."""
    return folder.with_name(f"{folder.name}.sha256")


def unsealed(folder: Path, published: str | None = None, key: Path | None = None) -> list[dict[str, Any]]:
    """The truths of a sealed folder, once its answers are known to be those whose hash was `published`; without it, by
    the hash that lies beside the folder. key: the file with what opens them, beside the folder where not given.

    Raises LogError where they are not, or can't be read.
    """
    try:
        check_small(folder / ANSWERS)
        data = (folder / ANSWERS).read_bytes()
        told = published or read_small(hash_path(folder)).split(maxsplit=1)[0]
    except (OSError, UnicodeDecodeError, IndexError):
        raise LogError(
            f"{folder}: holds no {ANSWERS}, or {hash_path(folder).name} is not beside it; give a folder of challenge "
            "seal, and the hash that was published with --hash"
        ) from None
    digest = hashlib.sha256(data).hexdigest()
    if told.lower() != digest:
        raise LogError(
            f"{folder / ANSWERS}: its SHA-256 is {digest}, and {told} was published: the answers were changed after "
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
