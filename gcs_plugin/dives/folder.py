"""Dive folders: `dives/2026-11-20T0912Z-hovering/` with `telemetry.tlog` and `dive.yaml`, ordered by their start."""

import contextlib
import re
import shutil
import unicodedata
from collections.abc import Callable
from dataclasses import asdict, dataclass, field, replace
from datetime import UTC, datetime
from pathlib import Path
from typing import Final

import yaml

from bridge import schema
from bridge.clock import utc_text
from bridge.errors import ConfigError, LogError
from bridge.files import sync_folder, write_whole
from bridge.vehicle.config import CONFIGS, VehicleFile
from bridge.wire.tlog import SUFFIXES
from bridge.wire.whole_recording import WHOLE, files_to_read, number
from gcs_plugin.dives.conditions import NOTHING_SAID, Conditions
from gcs_plugin.dives.recordings import order, recordings
from gcs_plugin.locks import LockedTlogWriter, folder_lock

ABOUT: Final = "dive.yaml"
YAML: Final = (".yaml", ".yml")


@dataclass(frozen=True)
class Event:
    """Event in a dive, with its time as UTC text."""

    utc: str
    text: str


@dataclass(frozen=True)
class About:
    """Content of `dive.yaml`: vehicle file and its hash, configuration, notes, events, conditions."""

    vehicle_file: str = ""
    vehicle_sha256: str = ""
    configuration: str = ""
    notes: str = ""
    events: tuple[Event, ...] = field(default=())
    conditions: Conditions = NOTHING_SAID

    @property
    def vehicle_path(self) -> Path | None:
        """The vehicle file named in `dive.yaml`, None if it is missing or no YAML file: a dive may name any path."""
        named = Path(self.vehicle_file)
        return named if named.suffix in YAML and named.is_file() else None


@dataclass(frozen=True)
class DiveFolder:
    """A dive's folder on the disk, with its recordings and `dive.yaml`."""

    path: Path

    def about(self) -> About:
        """Read `dive.yaml`; all fields empty if it is missing. Raises ConfigError if it is damaged."""
        file = self.path / ABOUT
        if not file.exists():
            return About()
        if not file.is_file():
            raise ConfigError(f"{file}: is no file; take it away")
        return schema.build(About, schema.load_yaml(file) or {}, str(file))

    def describe(self, about: About) -> None:
        """Write `dive.yaml` atomically; it is on the disk when this returns. Raises LogError if it can't be written."""
        file = self.path / ABOUT
        data = asdict(about)
        data["events"] = [asdict(event) for event in about.events]
        try:
            write_whole(file, yaml.safe_dump(data, sort_keys=False, allow_unicode=True), synced=True)
        except OSError as error:
            raise LogError(f"{file}: can't be written ({error.strerror}); check the disk") from None
        sync_folder(self.path)

    def change(self, by: Callable[[About], About]) -> None:
        """Read `dive.yaml`, change it by `by`, and write it, under the lock of the folder."""
        with folder_lock(self.path):
            self.describe(by(self.about()))

    def add_event(self, unix_s: float, text: str) -> None:
        event = Event(utc_text(unix_s), text)
        self.change(lambda about: replace(about, events=(*about.events, event)))

    def note(self, text: str) -> None:
        """Replace the notes of the dive by `text`."""
        self.change(lambda about: replace(about, notes=text))

    def set_conditions(self, conditions: Conditions) -> None:
        self.change(lambda about: replace(about, conditions=conditions))

    def discard(self, own_notes: str = "") -> None:
        """Delete the recordings and folder of a dive that is none, unless it has events, notes, other conditions than
        the dive before it, or other files. `own_notes` are those that the program made itself.

        A dive.yaml that can't be read may have some, and a disk that fails keeps all.
        """
        try:
            about = self.about()
            taken_over = (NOTHING_SAID, last_conditions(self.path.parent, self.path))
            noted = (
                bool(about.events) or about.notes not in ("", own_notes) or about.conditions not in taken_over
            )
        except (ConfigError, LogError):
            noted = True
        with contextlib.suppress(OSError):
            for path in (*self.telemetry(), *([] if noted else [self.path / ABOUT])):
                path.unlink(missing_ok=True)
            self.path.rmdir()

    def telemetry(self) -> list[Path]:
        """The recordings to read: the file merged from all recordings if it exists, otherwise as `heard`."""
        return files_to_read(self._recordings())

    def heard(self) -> list[Path]:
        """Recordings made by the ground station, in the order in which they were begun."""
        return [path for path in self._recordings() if path.name != WHOLE]

    def _recordings(self) -> list[Path]:
        return sorted((path for path in recordings(self.path) if path.name.endswith(SUFFIXES)), key=number)

    def free_bytes(self) -> int:
        """Free bytes on the folder's disk, also if the folder was removed. Raises OSError."""
        present = next((path for path in (self.path, *self.path.parents) if path.exists()), self.path)
        return shutil.disk_usage(present).free

    def open_telemetry(self, number: int, about: About | None = None) -> LockedTlogWriter:
        """Open a new recording: 1 is `telemetry.tlog`, 2 is `telemetry.2.tlog`. Raises LogError.

        With `about`, a missing `dive.yaml` is written anew, and so is the folder if it was removed meanwhile.
        """
        if about is not None and not (self.path / ABOUT).exists():
            try:
                self.path.mkdir(parents=True, exist_ok=True)
            except OSError as error:
                raise LogError(f"{self.path}: can't be made anew ({error.strerror}); make it") from None
            self.describe(about)
        name = "telemetry.tlog" if number == 1 else f"telemetry.{number}.tlog"
        return LockedTlogWriter(self.path / name)


def new_folder(root: Path, unix_s: float, name: str) -> DiveFolder:
    """Create the folder of a dive that begins at `unix_s`; a number is appended if the name is taken.

    Raises LogError if no folder can be created.
    """
    words = re.sub(r"[\W_]+", "-", unicodedata.normalize("NFC", name.lower())).strip("-")
    stem = f"{datetime.fromtimestamp(unix_s, UTC):%Y-%m-%dT%H%MZ}" + (f"-{words}" if words else "")
    try:
        root.mkdir(parents=True, exist_ok=True)
        for number in range(1, 1000):
            path = root / (stem if number == 1 else f"{stem}-{number}")
            try:
                path.mkdir()
            except FileExistsError:
                continue
            return DiveFolder(path)
    except OSError as error:
        raise LogError(
            f"{root}: no dive folder can be made there ({error.strerror}); choose another"
        ) from None
    raise LogError(f"{root / stem}: a thousand folders of that minute exist; clear some away")


def list_folders(root: Path) -> list[DiveFolder]:
    """The dives under `root`, oldest first: every folder with a recording, whatever its name and even if the recording
    can't be opened. Raises LogError if `root` can't be read.
    """
    return _in_order(root, lambda path: bool(recordings(path)))


def _in_order(root: Path, wanted: Callable[[Path], bool]) -> list[DiveFolder]:
    if not root.is_dir():
        return []
    try:
        return [DiveFolder(p) for p in sorted(filter(Path.is_dir, root.iterdir()), key=order) if wanted(p)]
    except OSError as error:
        raise LogError(f"{root}: can't be read ({error.strerror}); check its rights") from None


def find_folder(path: Path) -> DiveFolder:
    """The dive folder `path`. Raises LogError if it is missing, a file, or has neither a recording nor `dive.yaml`."""
    if not path.exists():
        raise LogError(f"{path}: no such dive folder; check the name")
    if not path.is_dir():
        raise LogError(f"{path}: is a file; give the folder of a dive")
    if not any(path.glob("telemetry*.*")) and not (path / ABOUT).exists():
        raise LogError(f"{path}: holds no telemetry.tlog and no {ABOUT}; give the folder of a dive")
    return DiveFolder(path)


def load_folder(path: Path) -> DiveFolder:
    """The dive folder `path`. Raises LogError if it is no dive folder or has no `.tlog` or `.tlog.gz`."""
    folder = find_folder(path)
    if not folder.telemetry():
        raise LogError(f"{path}: holds no telemetry.tlog; give the folder of a dive")
    return folder


def about_vehicle(file: VehicleFile, configuration: str, notes: str = "") -> About:
    """Content of `dive.yaml` for a new dive with this vehicle."""
    return About(str(file.path), file.sha256, configuration, notes)


def vehicle_named(about: About, otherwise: str = "") -> str:
    """FILE[:CONFIGURATION] of a dive; `otherwise` if the dive names no file, or a missing one.

    A file that has moved is looked for among those bundled with the program. Raises ConfigError if it is missing
    there too and `otherwise` is "".
    """
    if not about.vehicle_file:
        return otherwise
    bundled = replace(about, vehicle_file=str(CONFIGS / "vehicles" / Path(about.vehicle_file).name))
    file = about.vehicle_path or bundled.vehicle_path
    if file is not None:
        return ":".join(filter(None, (str(file), about.configuration)))
    if not otherwise:
        raise ConfigError(
            f"{about.vehicle_file}: the dive's vehicle file is not there; give one with --vehicle"
        )
    return otherwise


def last_conditions(root: Path, before: Path) -> Conditions:
    """Conditions of the newest dive under `root` that has any and is earlier than the folder `before`."""
    # A dive without a recording so far is later than all others.
    last = order(before) if recordings(before) else None
    for folder in reversed(_in_order(root, lambda path: (path / ABOUT).exists())):
        if folder.path.resolve() == before.resolve():
            continue
        if last is not None and order(folder.path) >= last:
            continue
        try:
            conditions = folder.about().conditions
        except ConfigError:
            continue
        if conditions != NOTHING_SAID:
            return conditions
    return NOTHING_SAID


def conditions_of(dive: Path) -> Conditions:
    """Conditions of a dive folder, or of a recording in it. Raises ConfigError if its `dive.yaml` is damaged."""
    return DiveFolder(dive if dive.is_dir() else dive.parent).about().conditions
