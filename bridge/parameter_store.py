"""The file that keeps a vehicle's parameters through a restart: small, replaced whole or not at all.

For each hull that the vehicle has had, told apart by its mark, it keeps the mode and the set that was committed.
"""

import json
import math
import os
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

from bridge.errors import ParamError
from bridge.file_size import read_small
from bridge.folder_sync import sync_folder
from bridge.plain import from_json

UNTOLD: Final = ""
"""In place of a hull's mark, of what an earlier version kept: it told none."""


@dataclass(frozen=True)
class Stored:
    """Of one hull the mode, and the active set by parameter id; None where no set was ever committed on it."""

    mode: float
    active: Mapping[str, float] | None


def save(path: Path, hulls: Mapping[str, Stored]) -> None:
    """Replace the file in one step, on the disk before this returns; what it keeps of each hull, by its mark.

    Raises ParamError where it can't.
    """
    kept = {
        mark: {"mode": stored.mode, "active": None if stored.active is None else dict(stored.active)}
        for mark, stored in hulls.items()
    }
    text = json.dumps({"hulls": kept}, indent=1)
    new = path.with_name(path.name + ".new")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        with open(new, "w", encoding="utf-8") as file:
            file.write(text)
            file.flush()
            os.fsync(file.fileno())
        os.replace(new, path)
        sync_folder(path.parent)
    except OSError as error:
        raise ParamError(f"{path}: parameters can't be stored ({error.strerror}); check the disk") from None


def load(path: Path) -> dict[str, Stored]:
    """What the file keeps of each hull, by its mark; nothing where there is no file. That of an earlier version is
    `UNTOLD`'s. Raises ParamError where it is damaged."""
    try:
        data = from_json(read_small(path))
    except FileNotFoundError:
        return {}
    except (OSError, ValueError) as error:
        raise ParamError(f"{path}: stored parameters can't be read ({error}); upload them again") from None
    kept = data["hulls"] if isinstance(data, dict) and set(data) == {"hulls"} else {UNTOLD: data}
    hulls = {mark: _checked(one) for mark, one in kept.items()} if isinstance(kept, dict) else {UNTOLD: None}
    whole = {mark: stored for mark, stored in hulls.items() if stored is not None}
    if len(whole) < len(hulls):
        raise ParamError(f"{path}: stored parameters are damaged; upload them again")
    return whole


def put_aside(path: Path) -> Path:
    """Keep a damaged file under a name of its own. Raises ParamError where that fails."""
    number = 1
    while (aside := path.with_name(f"{path.name}.damaged-{number}")).exists():
        number += 1
    try:
        os.replace(path, aside)
    except OSError as error:
        raise ParamError(f"{path}: can't be put aside ({error.strerror}); move it away") from None
    return aside


def _checked(data: Any) -> Stored | None:
    if not isinstance(data, dict) or set(data) != {"mode", "active"} or not _is_number(data["mode"]):
        return None
    active = data["active"]
    if active is None:
        return Stored(float(data["mode"]), None)
    if not isinstance(active, dict) or not all(_is_number(value) for value in active.values()):
        return None
    return Stored(float(data["mode"]), {name: float(value) for name, value in active.items()})


def _is_number(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool) and math.isfinite(value)
