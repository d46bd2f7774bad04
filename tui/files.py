"""The files of a verb, its page and its figures: checked before it reads anything, written independently of each other.

Those that can't be written are named after all other output.
"""

import argparse
import glob
import os
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from types import TracebackType
from typing import TYPE_CHECKING, Any, Self

from bridge import exit_codes, reports
from bridge.command_line import check_folder
from bridge.errors import LogError, ParamUnwritten
from bridge.exit_codes import UsageError
from bridge.plain import plain
from bridge.reports import PAGE
from bridge.vehicle.config import CONFIGS, VehicleFile, load_vehicle
from gcs_plugin.params.sidecar import sidecar_path
from tui import show
from tui.cli import complain
from tui.options import PARAMETER_SUFFIXES, FolderTarget, NewFile, NewFolder, Output, ParameterTarget, Target
from tui.show import STANDARD_OUTPUT

if TYPE_CHECKING:
    from identify.dive import Dive
    from identify.report.page import Report

READ = (
    *("dives", "dive", "folder", "file", "files", "log", "after", "mission", "check", "against"),
    *("accepted", "foretold", "plan", "limits", "key", "sign_key"),
)
"""Words and options of all verbs that name files or folders to read, besides the vehicle file and its column map."""

ANSWERS = "case_*.json"
"""The files that `challenge score` reads in the folder of --answers."""

VEHICLES = ("vehicle", "otherwise")
"""Options of all verbs that name a vehicle file."""

RECORDING_SUFFIXES = (".tlog", ".tlog.gz", ".bin")
DIVE_FOLDER_FILES = ("dive.yaml", "columns.yaml")


def check_places(arguments: argparse.Namespace) -> None:
    """Raise UsageError if a place that the options of a verb name for its results can't be taken.

    Nor may two options name the same file, or one a file that the same command reads; links of either kind to a file
    count as the same file. Raises ConfigError if the vehicle file can't be read.
    """
    # Of the vehicle's program, which knows no kinds of places, and of simulate, which makes its folder.
    kept = getattr(arguments, "parameters", None)
    targets = {"--parameters": Path(kept)} if kept else {}
    for name, place in vars(arguments).items():
        option = f"--{name.replace('_', '-')}"
        if isinstance(place, FolderTarget):
            check_folder(option, place)
        elif isinstance(place, NewFolder):
            _check_new_folder(option, place)
        elif isinstance(place, NewFile) and place:
            check_new_file(option, place)
        elif isinstance(place, Output) and place == STANDARD_OUTPUT:
            continue
        elif isinstance(place, Target):
            _check_file(option, place, place.suffixes)
            targets[option] = Path(place)
            if isinstance(place, ParameterTarget):
                sidecar = sidecar_path(targets[option])
                _check_file(f"the sidecar of {option}", str(sidecar))
                targets[f"the sidecar of {option}"] = sidecar
    _check_different(targets)
    present = {option: path for option, path in targets.items() if path.is_file()}
    for source in _inputs(arguments) if present else ():
        for option, path in present.items():
            if path.samefile(source):
                raise UsageError(
                    f"{option} {path}: would write over {source}, which this command reads: nothing was done; "
                    "name another file"
                )


def _check_file(option: str, target: str, suffixes: tuple[str, ...] = ()) -> None:
    path = Path(target)
    if target == STANDARD_OUTPUT:
        raise UsageError(f"{option} {target}: can't go to standard output; name a file")
    if suffixes and path.suffix not in suffixes:
        raise UsageError(f"{option} {target}: the name must end in {' or '.join(suffixes)}; name it so")
    if path.is_dir() or not path.name:
        raise UsageError(f"{option} {target}: is a folder; name a file")
    if not path.parent.is_dir():
        raise UsageError(f"{option} {target}: there is no folder {path.parent}; make it, or name another")
    if not os.access(path if path.exists() else path.parent, os.W_OK):
        raise UsageError(f"{option} {target}: can't be written there; name another place")


def _check_new_folder(option: str, target: str) -> None:
    if Path(target).exists():
        raise UsageError(f"{option} {target}: exists already and is never overwritten; name another folder")
    check_folder(option, target)


def check_new_file(option: str, target: str) -> None:
    """Raise UsageError if a file exists already, or can't be made there."""
    if Path(target).exists():
        raise UsageError(f"{option} {target}: exists already and is never overwritten; name another file")
    _check_file(option, target)


def _check_different(targets: Mapping[str, Path]) -> None:
    taken: dict[Path, str] = {}
    for option, target in targets.items():
        first_option = taken.setdefault(target.absolute(), option)
        if first_option != option:
            raise UsageError(f"{option} {target}: {first_option} names the same file; name another")


def _inputs(arguments: argparse.Namespace) -> Iterator[Path]:
    """The existing files that a command reads."""
    for name in READ:
        words = getattr(arguments, name, None) or ()
        for word in (words,) if isinstance(words, str) else words:
            # A vehicle file may be named with its configuration, as our.yaml:heavy.
            for path in map(Path, [word, word.partition(":")[0], *glob.glob(word, recursive=True)]):
                yield from (place for place in (path, *_sidecars(path)) if path.name and place.is_file())
                yield from _of_dives(path)
    answers = getattr(arguments, "answers", None)
    if answers is not None:
        yield from filter(Path.is_file, Path(answers).glob(ANSWERS))
    columns = getattr(arguments, "columns", None)
    if columns is not None:
        yield from _first(Path(columns), CONFIGS / "columns" / f"{columns}.yaml")
    for vehicle in filter(None, (getattr(arguments, name, None) for name in VEHICLES)):
        file = load_vehicle(vehicle)
        table = file.vehicle.thrust_curve.file
        yield file.path
        yield from _first(file.path.with_suffix(".truth.yaml"))
        yield from _first(file.path.parent / table, CONFIGS / "thrusters" / table)


def _sidecars(path: Path) -> Iterator[Path]:
    """The sidecar of a parameter file; other files have none, whatever stands beside them."""
    if path.is_file() and path.suffix in PARAMETER_SUFFIXES:
        yield sidecar_path(path)


def _first(*places: Path) -> list[Path]:
    return [place for place in places if place.is_file()][:1]


def _of_dives(folder: Path) -> Iterator[Path]:
    """The recordings in a folder and its subfolders, and the other files that make them dives."""
    for place, _, names in os.walk(folder):
        for name in names:
            of_dive = name.startswith("telemetry") or name in DIVE_FOLDER_FILES
            if (of_dive or name.lower().endswith(RECORDING_SUFFIXES)) and (Path(place) / name).is_file():
                yield Path(place) / name


class Files:
    """Within `with`, the files of a verb; at its end, each that could not be written is named on standard error.

    A failed file prevents neither the output nor another file. `written` lists the files written, in sentences.
    """

    def __init__(self) -> None:
        self.written: list[str] = []
        self._failed: list[str] = []

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, _type: type[BaseException] | None, _error: object, _trace: TracebackType | None
    ) -> None:
        for sentence in self._failed:
            complain(sentence)

    def attempt(self, write: Callable[[], object], sentence: str = "") -> bool:
        """Run `write` and return whether it succeeded; if so, add `sentence` to `written`, unless it is empty."""
        try:
            write()
        except BrokenPipeError:  # the reader of standard output has closed it
            raise
        except (LogError, ParamUnwritten) as error:
            self._failed.append(str(error))
            return False
        except OSError as error:
            place = f"{error.filename}: " if error.filename else ""
            self._failed.append(f"{place}can't be written ({error.strerror}); give another place")
            return False
        if sentence:
            self.written.append(sentence)
        return True

    def text(self, path: Path, text: str, sentence: str = "") -> bool:
        """`attempt` to write `text` to `path`, completely or not at all."""
        return self.attempt(lambda: show.write_text(text, str(path)), sentence)

    def json(self, data: Any, target: str | None) -> bool:
        """As `show.write_json`; if that fails, a program that follows the progress gets the data itself."""

        def write() -> None:
            try:
                show.write_json(data, target)
            except LogError as error:
                if reports.asked(os.environ):
                    show.tell_program(reports.Report(reports.UNKEPT, 1.0, str(error), result=plain(data)))
                raise

        return self.attempt(write)

    def publish(
        self,
        arguments: argparse.Namespace,
        report: "Callable[[], Report]",
        dives: "Sequence[Dive]",
        file: VehicleFile,
        page: str | None = None,
    ) -> None:
        """Write the page to `page`, otherwise to --report, and the figures, with progress, because drawing takes long.

        Without any of these options nothing is drawn.
        """
        page = page or arguments.report
        if not (page or arguments.figures):
            return
        with show.progress(PAGE) as tell:
            tell(0.0, WRITING)
            # They load matplotlib, which takes a second.
            from identify.report.page import with_provenance, write_figures, write_report

            whole = with_provenance(report(), dives, file, settings(arguments))
            if page:
                place = Path(page)
                self.attempt(
                    lambda: write_report(place, whole, lambda share: tell(share, WRITING)), f"report: {place}"
                )
            if arguments.figures:
                tell(1.0, "writing the figures")

                def draw() -> None:
                    drawn = write_figures(Path(arguments.figures), whole)
                    self.written.append(
                        f"figures: {arguments.figures} ({len(drawn) // 2}, each as SVG and PNG)"
                    )

                self.attempt(draw)

    def code(self, answered: int) -> int:
        """The exit code: BAD_INPUT if a file could not be written, otherwise that of the answer."""
        return exit_codes.BAD_INPUT if self._failed else answered


UNTOLD = ("report", "figures", "json", "csv", "out", "began_unix_s")
"""No settings: the places of results, and when the program began, which `cli.main` adds."""

WRITING = "writing the page"


def settings(arguments: argparse.Namespace) -> dict[str, str]:
    """The command line's settings, given or by default, under the names of their options."""
    return {
        name.replace("_", " "): " ".join(map(str, value)) if isinstance(value, list | tuple) else str(value)
        for name, value in vars(arguments).items()
        if value is not None and value is not False and value != [] and name not in UNTOLD
    }
