"""Dive folders: `dives/2026-11-20T0912Z-hovering/` with `telemetry.tlog` and `dive.yaml`, sorted by UTC."""

import contextlib
import re
import shutil
from collections.abc import Callable
from dataclasses import asdict, dataclass, field, replace
from datetime import UTC, datetime
from pathlib import Path
from typing import Final

import yaml

from bridge import schema
from bridge.errors import ConfigError, LogError
from bridge.new_file import whole
from bridge.ring.whole import WHOLE, standing_for
from bridge.vehicle.config import VehicleFile
from gcs_plugin.alone_in import alone_in
from gcs_plugin.conditions import NOTHING_SAID, Conditions
from gcs_plugin.dive_order import number, order, recordings
from gcs_plugin.in_use import HeldTlog

ABOUT: Final = "dive.yaml"
YAML: Final = (".yaml", ".yml")


@dataclass(frozen=True)
class Event:
    """Something that happened in a dive, at a time written as UTC."""

    utc: str
    text: str


@dataclass(frozen=True)
class About:
    """What `dive.yaml` says: the vehicle's file and its hash, the configuration, notes, events, conditions."""

    vehicle_file: str = ""
    vehicle_sha256: str = ""
    configuration: str = ""
    notes: str = ""
    events: tuple[Event, ...] = field(default=())
    conditions: Conditions = NOTHING_SAID

    @property
    def vehicle_path(self) -> Path | None:
        """The vehicle file that it names, where that is there; nothing but a YAML file is opened on a dive's word."""
        named = Path(self.vehicle_file)
        return named if named.suffix in YAML and named.is_file() else None


@dataclass(frozen=True)
class DiveFolder:
    """One dive on the disk."""

    path: Path

    def about(self) -> About:
        """What its `dive.yaml` says; all empty where it has none. Raises ConfigError for a damaged one."""
        file = self.path / ABOUT
        if not file.exists():
            return About()
        if not file.is_file():
            raise ConfigError(f"{file}: is no file; take it away")
        return schema.build(About, schema.load_yaml(file) or {}, str(file))

    def describe(self, about: About) -> None:
        """Write `dive.yaml`, whole or not at all."""
        file = self.path / ABOUT
        data = asdict(about)
        data["events"] = [asdict(event) for event in about.events]
        try:
            with whole(file) as made:
                made.write(yaml.safe_dump(data, sort_keys=False, allow_unicode=True).encode())
        except OSError as error:
            raise LogError(f"{file}: can't be written ({error.strerror}); check the disk") from None

    def change(self, by: Callable[[About], About]) -> None:
        """Read `dive.yaml`, change it, and write it, while no other program does."""
        with alone_in(self.path):
            self.describe(by(self.about()))

    def add_event(self, unix_s: float, text: str) -> None:
        event = Event(utc_text(unix_s), text)
        self.change(lambda about: replace(about, events=(*about.events, event)))

    def note(self, text: str) -> None:
        """Put `text` in place of the notes of the whole dive."""
        self.change(lambda about: replace(about, notes=text))

    def set_conditions(self, conditions: Conditions) -> None:
        """Put them in place of those that it had."""
        self.change(lambda about: replace(about, conditions=conditions))

    def discard(self) -> None:
        """Take it away, where nothing was heard in its dive; notes, and whatever else lies in it, keep it."""
        noted = bool(self.about().events)
        for path in (*self.telemetry(), *([] if noted else [self.path / ABOUT])):
            path.unlink(missing_ok=True)
        with contextlib.suppress(OSError):
            self.path.rmdir()

    def telemetry(self) -> list[Path]:
        """Its recordings to be read: as `heard`, or the one that was made whole of them."""
        return standing_for(sorted(self.path.glob("telemetry*.tlog"), key=number))

    def heard(self) -> list[Path]:
        """The ground's own recordings in the order in which they were begun."""
        return [path for path in sorted(self.path.glob("telemetry*.tlog"), key=number) if path.name != WHOLE]

    def free_bytes(self) -> int:
        """What the disk has left on which it lies, or is to lie again. Raises OSError."""
        present = next((path for path in (self.path, *self.path.parents) if path.exists()), self.path)
        return shutil.disk_usage(present).free

    def open_telemetry(self, number: int, about: About | None = None) -> HeldTlog:
        """A new recording: 1 is `telemetry.tlog`, 2 is `telemetry.2.tlog`. Raises LogError.

        Where somebody took the folder away meanwhile, it is made anew, and says `about`.
        """
        if about is not None and not (self.path / ABOUT).exists():
            try:
                self.path.mkdir(parents=True, exist_ok=True)
            except OSError as error:
                raise LogError(f"{self.path}: can't be made anew ({error.strerror}); make it") from None
            self.describe(about)
        name = "telemetry.tlog" if number == 1 else f"telemetry.{number}.tlog"
        return HeldTlog(self.path / name)


def new_folder(root: Path, unix_s: float, name: str) -> DiveFolder:
    """A folder of its own for a dive that begins now; another of that minute and name gets a number."""
    words = re.sub(r"[^a-z0-9]+", "-", name.lower()).strip("-")
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
    """The dives under `root`, oldest first, whatever their folders are called: all that hold a recording, be it one
    that can't be opened. Raises LogError where `root` can't be read."""
    return _in_order(root, lambda path: bool(recordings(path)))


def described_folders(root: Path) -> list[DiveFolder]:
    """The folders under `root` with a `dive.yaml`, oldest first: those of dives, and of one that is about to begin.
    Raises LogError where `root` can't be read."""
    return _in_order(root, lambda path: (path / ABOUT).exists())


def _in_order(root: Path, wanted: Callable[[Path], bool]) -> list[DiveFolder]:
    if not root.is_dir():
        return []
    try:
        return [DiveFolder(p) for p in sorted(filter(Path.is_dir, root.iterdir()), key=order) if wanted(p)]
    except OSError as error:
        raise LogError(f"{root}: can't be read ({error.strerror}); check its rights") from None


def find_folder(path: Path) -> DiveFolder:
    """A dive's folder. Raises LogError where there is none, or one that holds neither a recording nor `dive.yaml`."""
    if not path.exists():
        raise LogError(f"{path}: no such dive folder; check the name")
    if not path.is_dir():
        raise LogError(f"{path}: is a file; give the folder of a dive")
    if not any(path.glob("telemetry*.*")) and not (path / ABOUT).exists():
        raise LogError(f"{path}: holds no telemetry.tlog and no {ABOUT}; give the folder of a dive")
    return DiveFolder(path)


def load_folder(path: Path) -> DiveFolder:
    """A dive's folder with a `.tlog` in it. Raises LogError where it is none, or holds no such recording."""
    folder = find_folder(path)
    if not folder.telemetry():
        raise LogError(f"{path}: holds no telemetry.tlog; give the folder of a dive")
    return folder


def about_vehicle(file: VehicleFile, configuration: str, notes: str = "") -> About:
    """What `dive.yaml` says of a dive with this vehicle."""
    return About(str(file.path), file.sha256, configuration, notes)


def utc_text(unix_s: float) -> str:
    """`2026-11-20T09:12:03Z`."""
    return f"{datetime.fromtimestamp(unix_s, UTC):%Y-%m-%dT%H:%M:%SZ}"
