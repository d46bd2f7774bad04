"""Choose the vehicle file for a dive: the file that its `dive.yaml` names, otherwise a default."""

from dataclasses import replace
from pathlib import Path

from bridge.errors import ConfigError
from bridge.vehicle.config import CONFIGS
from gcs_plugin.folder import About


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
