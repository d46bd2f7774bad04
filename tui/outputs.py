"""The places that a verb will write to, looked at before it reads anything: no hour's work ends in a misspelt path."""

import os
from collections.abc import Mapping
from pathlib import Path

from tui.exit_codes import UsageError
from tui.show import STANDARD_OUTPUT

PARAMETER_SUFFIXES = (".param", ".parm", ".params")


def check_file(option: str, target: str | None, suffixes: tuple[str, ...] = ()) -> None:
    """Raise UsageError where a file named by `option` could not be written; None and `-` always can."""
    if target is None or target == STANDARD_OUTPUT:
        return
    path = Path(target)
    if suffixes and path.suffix not in suffixes:
        raise UsageError(f"{option} {target}: the name must end in {' or '.join(suffixes)}; name it so")
    if path.is_dir() or not path.name:
        raise UsageError(f"{option} {target}: is a folder; name a file")
    if not path.parent.is_dir():
        raise UsageError(f"{option} {target}: there is no folder {path.parent}; make it, or name another")
    if not os.access(path if path.exists() else path.parent, os.W_OK):
        raise UsageError(f"{option} {target}: can't be written there; name another place")


def check_files(targets: Mapping[str, str | None]) -> None:
    """`check_file` for each option, and that no two of them name one file."""
    taken: dict[Path, str] = {}
    for option, target in targets.items():
        check_file(option, target)
        if target is None or target == STANDARD_OUTPUT:
            continue
        other = taken.setdefault(Path(target).absolute(), option)
        if other != option:
            raise UsageError(f"{option} {target}: {other} names the same file; name another")


def check_new_folder(option: str, target: str) -> None:
    """Raise UsageError where the folder named by `option` exists or could not be made."""
    if Path(target).exists():
        raise UsageError(f"{option} {target}: exists already and is never overwritten; name another folder")
    check_folder(option, target)


def check_folder(option: str, target: str) -> None:
    """Raise UsageError where a folder named by `option` is none and could not be made."""
    path = Path(target)
    place = next(above for above in (path, *path.absolute().parents) if above.exists())
    if not place.is_dir():
        raise UsageError(f"{option} {target}: {place} is no folder; name another")
    if not os.access(place, os.W_OK):
        raise UsageError(f"{option} {target}: can't be written there; name another place")
