"""Recordings that a verb names: their column map, their vehicle file, the conditions that the crew wrote down."""

from collections.abc import Sequence
from pathlib import Path

from bridge.exit_codes import UsageError
from bridge.vehicle.config import VehicleFile
from gcs_plugin.dives.conditions import TETHER
from gcs_plugin.dives.folder import conditions_of
from identify.ingest.mapping.column_map import map_file
from identify.ingest.open import MAPPED, recording_files
from identify.run.joined_runs import together
from identify.run.recordings import Reading, Recording, read_each, read_runs, runs_in


def column_map_for(name: str | None, recordings: Sequence[str]) -> Path | None:
    """Path of the column map that was named; None if none was.

    Raises ConfigError if the map doesn't exist, UsageError if no recording needs one, LogError if a
    recording doesn't exist.
    """
    if not name:
        return None
    places = [place for recording in recordings for place in runs_in(Path(recording))]
    files = [file for place in places for file in recording_files(place)]
    if not any(file.name.lower().endswith(MAPPED) for file in files):
        raise UsageError(
            f"--columns {name}: {' and '.join(recordings)} need{'' if len(recordings) > 1 else 's'} no column map; "
            "leave it out"
        )
    return map_file(name)


def each_alone(recordings: Sequence[str]) -> list[Path]:
    """The recordings, each a dive of its own. Raises UsageError for a folder of several."""
    for recording in recordings:
        if Path(recording).is_dir() and len(runs := runs_in(Path(recording))) > 1:
            raise UsageError(
                f"{recording}: holds {len(runs)} recordings; name one of them, or give --together if they are runs of "
                "one vehicle under the same conditions"
            )
    return [Path(recording) for recording in recordings]


def read_together(recordings: Sequence[str | Path], file: VehicleFile, columns: Path | None) -> Reading:
    """Read recordings, and those in folders of runs, as one dive. Raises LogError, ConfigError, FitError."""
    return together(
        *read_each(
            [Path(recording) for recording in recordings],
            lambda place: read_runs(recording_at(place), file, columns),
        )
    )


def recording_at(path: Path) -> Recording:
    """A dive folder, or a recording in it, with the conditions of its `dive.yaml`."""
    conditions = conditions_of(path)
    return Recording(path, conditions.density_kg_m3, conditions.carried_kg)


def ruled_out(runs: Sequence[Path]) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Effects that the `dive.yaml` of each run rules out as causes of a dive's gap, and the reason, in sentences."""
    if not all(TETHER in conditions_of(run).impossible for run in runs):
        return (), ()
    return (TETHER,), tuple(
        f"{run.name}: no tether was out, so a tether is not among the causes" for run in runs[:1]
    )
