"""The file that keeps a vehicle's parameters through a restart: small, replaced as a whole or not at all.

For each hull that the vehicle has had, identified by its mark, it keeps the mode and the committed set.
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
"""Stands for the hull mark in data of an earlier version, which stored none."""


@dataclass(frozen=True)
class Stored:
    """Mode and active set (by parameter id) of one hull; `active` is None if no set was ever committed on it."""

    mode: float
    active: Mapping[str, float] | None


def save(path: Path, hulls: Mapping[str, Stored]) -> None:
    """Replace the file in one step by the entries of `hulls`, by hull mark. It is on the disk when this returns.

    Raises ParamError if that fails.
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
    """Return the entry of each hull by its mark; {} if there is no file.

    The data of an earlier version is the entry of `UNTOLD`. Raises ParamError if the file is damaged.
    """
    try:
        data = from_json(read_small(path))
    except FileNotFoundError:
        return {}
    except (OSError, ValueError) as error:
        raise ParamError(f"{path}: stored parameters can't be read ({error}); upload them again") from None
    kept = data["hulls"] if isinstance(data, dict) and set(data) == {"hulls"} else {UNTOLD: data}
    hulls = (
        {mark: _checked(entry) for mark, entry in kept.items()} if isinstance(kept, dict) else {UNTOLD: None}
    )
    whole = {mark: stored for mark, stored in hulls.items() if stored is not None}
    if len(whole) < len(hulls):
        raise ParamError(f"{path}: stored parameters are damaged; upload them again")
    return whole


def put_aside(path: Path) -> Path:
    """Rename a damaged file to a free name and return its new path. Raises ParamError if that fails."""
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
