"""Recordings as the analyses read them: the dive, the vehicle file under the dive's conditions, remarks on both."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Final, TypeVar

from bridge.errors import LogError
from bridge.vehicle.config import Configuration, VehicleFile
from bridge.wire.tlog import SUFFIXES
from identify.dive import Dive
from identify.ingest.mavlink.frames import locate
from identify.ingest.open import MAPPED, read_dive, read_dives, recording_files

_Read = TypeVar("_Read")

TOTAL_MASSES: Final = ("M_u", "M_v", "M_w")
LEAST_CHANGE_KG_M3: Final = 0.1
"""Least change of density that is applied: 1 mm of depth at 10 m."""

OF_A_RECORD: Final = 30
"""Bytes after the last payload that may still belong to it: checksum, signature, and a partial stamp after a cut."""


@dataclass(frozen=True)
class Recording:
    """A recording or a dive folder, with the conditions of its dive: density of the water, mass carried in addition."""

    path: Path
    density_kg_m3: float | None = None
    carried_kg: float = 0.0

    def under_conditions(self, file: VehicleFile) -> tuple[VehicleFile, tuple[str, ...]]:
        """The vehicle file for this dive, and its changes, in sentences.

        The mass carried adds to the dry mass, and to the total masses of the file's model, which assume that dry mass.
        """
        vehicle, changes = file.vehicle, []
        density, filed = self.density_kg_m3, vehicle.water.density_kg_m3
        if density is not None and abs(density - filed) >= LEAST_CHANGE_KG_M3:
            vehicle = replace(vehicle, water=replace(vehicle.water, density_kg_m3=density))
            changes.append(
                f"water of {density:.1f} kg/m3 by the dive's temperature and salinity, not the vehicle file's "
                f"{filed:.1f}"
            )
        if self.carried_kg:
            configurations = {name: self._heavier(each) for name, each in vehicle.configurations.items()}
            vehicle = replace(vehicle, configurations=configurations)
            changes.append(
                f"{self.carried_kg:+g} kg of ballast and payload on top of the vehicle file's dry mass"
            )
        return replace(file, vehicle=vehicle), tuple(f"{self.path.name}: {sentence}" for sentence in changes)

    def _heavier(self, configuration: Configuration) -> Configuration:
        model = {
            name: value + self.carried_kg * (name in TOTAL_MASSES)
            for name, value in configuration.model.items()
        }
        return replace(configuration, dry_mass_kg=configuration.dry_mass_kg + self.carried_kg, model=model)


@dataclass(frozen=True)
class Reading:
    """A dive, the vehicle file to judge it by, and remarks on how the dive's conditions changed that file."""

    dive: Dive
    file: VehicleFile
    remarks: tuple[str, ...]

    @property
    def configuration(self) -> str:
        """The configuration that the user named, otherwise the recording's own. Raises ConfigError if it is open."""
        return self.file.configuration_of(self.dive.configuration_index())


def read(recording: Recording, file: VehicleFile, columns: Path | None = None) -> Reading:
    """Read a recording; `columns` is the column map of a table. Raises LogError, ConfigError."""
    file, remarks = recording.under_conditions(file)
    return Reading(read_dive(recording.path, columns, file), file, remarks)


def read_runs(recording: Recording, file: VehicleFile, columns: Path | None = None) -> list[Reading]:
    """As `read`, each run of a table that holds several."""
    file, remarks = recording.under_conditions(file)
    return [Reading(dive, file, remarks) for dive in read_dives(recording.path, columns, file)]


def runs_in(path: Path) -> list[Path]:
    """The recordings of a folder of runs, in order of their names; the path itself if it is one recording.

    Raises LogError if it holds none.
    """
    try:
        recording_files(path)
        return [path]
    except LogError:
        runs = [place for place in sorted(path.glob("*")) if _is_recording(place)]
        if not runs:
            raise
        return runs


def read_each(
    paths: Sequence[Path], read: Callable[[Path], Sequence[_Read]]
) -> tuple[list[_Read], dict[str, str]]:
    """The results of `read` for recordings, those in folders of runs too; and why runs of a folder were left out.

    A run of a folder that can't be read, or a text that is none, is left out. Raises LogError for any other recording
    that can't be, and for a folder of which as many can't be read as can.
    """
    held, left_out = list[_Read](), dict[str, str]()
    for path in paths:
        places, unread = runs_in(path), list[LogError]()
        for place in places:
            try:
                held += read(place)
            except LogError as error:
                if place == path:
                    raise
                unread.append(error)
                left_out[place.name] = error.reason if str(error.of) == str(place) else str(error)
        if 2 * len(unread) >= len(places):
            raise unread[0]
    return held, left_out


def _is_recording(path: Path) -> bool:
    if path.is_file():
        return path.name.lower().endswith((*SUFFIXES, ".bin", *MAPPED)) and not path.name.startswith(".")
    try:
        return bool(recording_files(path))
    except LogError:
        return False


def stray_bytes(recording: Path) -> str:
    """A sentence about a recording or a dive folder; "" if each byte of its `.tlog` belongs to a message.

    Raises LogError if there is no recording.
    """
    files = [file for file in recording_files(recording) if file.name.lower().endswith(SUFFIXES)]
    names = [file.name if file == recording else f"{recording.name}/{file.name}" for file in files]
    return ". ".join(filter(None, map(_stray, files, names)))


def _stray(file: Path, name: str) -> str:
    try:
        located = locate(file)
    except LogError:
        # The reader of the dive reports a file that is empty or can't be read.
        return ""
    count = located.counts["skipped"]
    if not count:
        return ""
    behind = len(located.data) - int(located.start[-1] + located.length[-1]) if len(located.start) else count
    if behind >= count:
        position = "at its end"
    else:
        position = "between its messages and at its end" if behind > OF_A_RECORD else "between its messages"
    return f"{name}: {count} bytes {position} belong to no message and were left out"
