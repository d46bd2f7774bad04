"""Recordings as a verb reads them: column map, vehicle file, the dive's conditions, bytes that belong to no message."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Final

from bridge.errors import ConfigError, LogError
from bridge.vehicle.config import CONFIGS, Configuration, VehicleFile
from gcs_plugin.dives.conditions import Conditions
from gcs_plugin.dives.folder import About, DiveFolder
from tui.exit_codes import UsageError

TETHER: Final = "tether"
TOTAL_MASSES: Final = ("M_u", "M_v", "M_w")
LEAST_CHANGE_KG_M3: Final = 0.1
"""Least change of density that is applied: 1 mm of depth at 10 m."""

OF_A_RECORD: Final = 30
"""Bytes after the last payload that may still belong to it: checksum, signature, and a partial stamp after a cut."""


def column_map_for(name: str | None, recordings: Sequence[str]) -> Path | None:
    """Path of the column map that was named; None if none was.

    Raises UsageError if the map doesn't exist, or if no recording is a table: a user who names a map wants to read a
    table. Raises LogError if a recording doesn't exist.
    """
    from identify.ingest.open import recording_files

    if not name:
        return None
    files = [file for recording in recordings for file in recording_files(Path(recording))]
    if not any(file.suffix.lower() == ".csv" for file in files):
        raise UsageError(
            f"--columns {name}: {' and '.join(recordings)} {'are' if len(recordings) > 1 else 'is'} no table (.csv), "
            f"and need{'' if len(recordings) > 1 else 's'} no column map; leave it out"
        )
    bundled = CONFIGS / "columns"
    if not Path(name).exists() and not (bundled / f"{name}.yaml").exists():
        known = ", ".join(sorted(file.stem for file in bundled.glob("*.yaml")))
        raise UsageError(f"--columns {name}: no such column map; give a YAML file, or one of {known}")
    return Path(name)


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


def stray_bytes(recording: Path) -> str:
    """A sentence about a recording or a dive folder; "" if each byte of its `.tlog` belongs to a message.

    Raises LogError if there is no recording.
    """
    from identify.ingest.open import recording_files

    files = [file for file in recording_files(recording) if file.name.endswith((".tlog", ".tlog.gz"))]
    names = [file.name if file == recording else f"{recording.name}/{file.name}" for file in files]
    return ". ".join(filter(None, map(_stray, files, names)))


def _stray(file: Path, name: str) -> str:
    from identify.ingest.frames import locate

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


def under_conditions(file: VehicleFile, dive: Path) -> tuple[VehicleFile, tuple[str, ...]]:
    """The vehicle file for a dive folder, or a recording in it, and the changes by its `dive.yaml`, in sentences.

    The mass carried adds to the dry mass, and to the total masses of the file's model, which assume that dry mass.
    """
    conditions = _conditions(dive)
    vehicle, changes = file.vehicle, []
    density, filed = conditions.density_kg_m3, vehicle.water.density_kg_m3
    if density is not None and abs(density - filed) >= LEAST_CHANGE_KG_M3:
        vehicle = replace(vehicle, water=replace(vehicle.water, density_kg_m3=density))
        changes.append(
            f"water of {density:.1f} kg/m3 by the dive's temperature and salinity, not the vehicle file's {filed:.1f}"
        )
    if carried_kg := conditions.carried_kg:
        shapes = {name: _heavier(shape, carried_kg) for name, shape in vehicle.configurations.items()}
        vehicle = replace(vehicle, configurations=shapes)
        changes.append(f"{carried_kg:+g} kg of ballast and payload on top of the vehicle file's dry mass")
    return replace(file, vehicle=vehicle), tuple(f"{dive.name}: {sentence}" for sentence in changes)


def can_not_be(dive: Path) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Effects that the `dive.yaml` rules out as causes of a dive's gap, and the reason, in sentences."""
    if _conditions(dive).tether_out_m != 0.0:
        return (), ()
    return (TETHER,), (f"{dive.name}: no tether was out, so a tether is not among the causes",)


def _conditions(dive: Path) -> Conditions:
    """The conditions of a dive folder, or of a recording in it."""
    return DiveFolder(dive if dive.is_dir() else dive.parent).about().conditions


def _heavier(shape: Configuration, carried_kg: float) -> Configuration:
    model = {name: value + carried_kg * (name in TOTAL_MASSES) for name, value in shape.model.items()}
    return replace(shape, dry_mass_kg=shape.dry_mass_kg + carried_kg, model=model)
