"""`seal`: dives with hidden effects in a folder, their answers locked beside them, and a hash that was there before.

    FOLDER/case_001/dive.tlog     to diagnose
    FOLDER/case_001/check.tlog    another mission of the same vehicle, with what was there still there
    FOLDER/case_001/vehicle.yaml  what its crew knows
    FOLDER/answers.sealed         JSON with a nonce: nobody finds the answers by trying hashes of likely ones
    FOLDER/SHA256                 of answers.sealed, also printed: written before anything is diagnosed

Who knows the seed can make the answers again: keep it from those who are judged.
"""

import hashlib
import json
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from bridge.errors import LogError
from identify.challenge.case import Case, check_of, dive_of, draw_case
from identify.challenge.recording import tlog_of

ANSWERS, HASH = "answers.sealed", "SHA256"
SEEDS = 10_000
"""Cases to a seed at most, so that two seeds share none."""


def case_name(number: int) -> str:
    return f"case_{number:03d}"


def seal(
    folder: Path,
    cases: int,
    seed: int,
    nonce: str,
    progress: Callable[[float, str], None],
    without: Sequence[str] = (),
) -> str:
    """Make `cases` cases of a seed in a new folder; answers the SHA-256 of the locked answers.

    What `without` names is hidden as something unknown, and nowhere else: who diagnoses leaves it out of the library.

    Raises LogError where the folder exists or can't be written.
    """
    if not 1 <= cases < SEEDS:
        raise LogError(f"{cases} cases can't be sealed; ask for 1 to {SEEDS - 1}")
    truths: list[dict[str, Any]] = []
    try:
        folder.mkdir(parents=True)
        for number in range(1, cases + 1):
            case = draw_case(seed * SEEDS + number, name=case_name(number), without=without)
            _write(folder / case.name, case)
            truths.append(case.truth())
            progress(number / cases, f"sealing {case.name}")
        sealed = {"version": 1, "nonce": nonce, "seed": seed, "without": list(without), "cases": truths}
        data = (json.dumps(sealed, indent=1, allow_nan=False) + "\n").encode()
        digest = hashlib.sha256(data).hexdigest()
        (folder / HASH).write_text(f"{digest}  {ANSWERS}\n", encoding="ascii")
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


def unsealed(folder: Path) -> list[dict[str, Any]]:
    """The truths of a sealed folder, once its answers are known to be those whose hash was published.

    Raises LogError where they are not, or can't be read.
    """
    try:
        data, published = (folder / ANSWERS).read_bytes(), (folder / HASH).read_text(encoding="ascii").split()
    except (OSError, UnicodeDecodeError):
        raise LogError(
            f"{folder}: holds no {ANSWERS} with its {HASH}; give a folder of challenge seal"
        ) from None
    digest = hashlib.sha256(data).hexdigest()
    if published[:1] != [digest]:
        raise LogError(
            f"{folder / ANSWERS}: its SHA-256 is {digest}, and {published[0] if published else 'none'} was published: "
            "the answers were changed after sealing, so nothing is scored; seal anew"
        )
    truths: list[dict[str, Any]] = json.loads(data)["cases"]
    return truths
