"""`--columns MAP` of the verbs that read recordings."""

from collections.abc import Sequence
from pathlib import Path

from bridge.vehicle.config import CONFIGS
from tui.exit_codes import UsageError


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
