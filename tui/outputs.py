"""Check the files that a verb will write before it reads anything, so that no hour's work ends in a misspelt path."""

import argparse
import glob
import os
from collections.abc import Iterator, Mapping
from pathlib import Path

from bridge.vehicle.config import CONFIGS, load_vehicle
from gcs_plugin.params.sidecar import sidecar_path
from tui.exit_codes import UsageError
from tui.show import STANDARD_OUTPUT

PARAMETER_SUFFIXES = (".param", ".parm", ".params")
WRITTEN = ("json", "csv", "param", "report", "out", "parameters", "predict")
"""Options of all verbs that name a file to write; an option that names a folder does no harm here."""

READ = ("dives", "dive", "folder", "file", "files", "after", "mission", "check", "against", "accepted")
"""Words and options of all verbs that name files or folders to read, besides the vehicle file and its column map."""

VEHICLES = ("vehicle", "otherwise")
"""Options of all verbs that name a vehicle file."""

RECORDING_SUFFIXES = (".tlog", ".tlog.gz", ".bin")
DIVE_FOLDER_FILES = ("dive.yaml", "columns.yaml")


def check_file(option: str, target: str | None, suffixes: tuple[str, ...] = ()) -> None:
    """Raise UsageError if the file named by `option` can't be written; None and `-` always can."""
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
    """`check_file` for each option, and check that no two of them name the same file."""
    taken: dict[Path, str] = {}
    for option, target in targets.items():
        check_file(option, target)
        if target is None or target == STANDARD_OUTPUT:
            continue
        first_option = taken.setdefault(Path(target).absolute(), option)
        if first_option != option:
            raise UsageError(f"{option} {target}: {first_option} names the same file; name another")


def check_new_folder(option: str, target: str) -> None:
    """Raise UsageError if the folder named by `option` exists or can't be made."""
    if Path(target).exists():
        raise UsageError(f"{option} {target}: exists already and is never overwritten; name another folder")
    check_folder(option, target)


def check_folder(option: str, target: str) -> None:
    """Raise UsageError if `option` names neither a folder nor a path at which a folder can be made."""
    path = Path(target)
    place = next(above for above in (path, *path.absolute().parents) if os.path.lexists(above))
    if place.is_symlink() and not place.exists():
        raise UsageError(f"{option} {target}: {place} is a link that leads nowhere; name another")
    if not place.is_dir():
        raise UsageError(f"{option} {target}: {place} is no folder; name another")
    if not os.access(place, os.W_OK):
        raise UsageError(f"{option} {target}: can't be written there; name another place")


def check_no_folder(option: str, target: str) -> None:
    """Raise UsageError if a folder is at the file path named by `option`."""
    if Path(target).is_dir():
        raise UsageError(f"{option} {target}: is a folder; name a file")


def check_inputs_stay(arguments: argparse.Namespace) -> None:
    """Raise UsageError if an option of any verb would overwrite a file that the same command reads.

    Links of either kind to a file count as the same file. Raises ConfigError if the vehicle file can't be read.
    """
    targets = {f"--{name}": getattr(arguments, name, None) for name in WRITTEN}
    given = {option: Path(name) for option, name in targets.items() if name not in (None, STANDARD_OUTPUT)}
    if "--param" in given:
        given["the sidecar of --param"] = sidecar_path(given["--param"])
    present = {option: path for option, path in given.items() if path.is_file()}
    if not present:
        return
    for source in _inputs(arguments):
        for option, path in present.items():
            if path.samefile(source):
                raise UsageError(
                    f"{option} {path}: would write over {source}, which this command reads: nothing was done; "
                    "name another file"
                )


def _inputs(arguments: argparse.Namespace) -> Iterator[Path]:
    """The existing files that a command reads."""
    for name in READ:
        words = getattr(arguments, name, None) or ()
        for word in (words,) if isinstance(words, str) else words:
            for path in map(Path, [word, *glob.glob(word, recursive=True)]):
                yield from (place for place in (path, sidecar_path(path)) if path.name and place.is_file())
                yield from _of_dives(path)
    columns = getattr(arguments, "columns", None)
    if columns is not None:
        yield from _first(Path(columns), CONFIGS / "columns" / f"{columns}.yaml")
    for vehicle in filter(None, (getattr(arguments, name, None) for name in VEHICLES)):
        file = load_vehicle(vehicle)
        table = file.vehicle.thrust_curve.file
        yield file.path
        yield from _first(file.path.with_suffix(".truth.yaml"))
        yield from _first(file.path.parent / table, CONFIGS / "thrusters" / table)


def _first(*places: Path) -> list[Path]:
    return [place for place in places if place.is_file()][:1]


def _of_dives(folder: Path) -> Iterator[Path]:
    """The recordings in a folder and its subfolders, and the other files that make them dives."""
    for place, _, names in os.walk(folder):
        for name in names:
            of_dive = name.startswith("telemetry") or name in DIVE_FOLDER_FILES
            if (of_dive or name.lower().endswith(RECORDING_SUFFIXES)) and (Path(place) / name).is_file():
                yield Path(place) / name
