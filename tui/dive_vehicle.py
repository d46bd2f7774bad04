"""Which vehicle file a dive is looked at with: the one that its `dive.yaml` names, else another."""

from dataclasses import replace
from pathlib import Path

from bridge.errors import ConfigError
from bridge.vehicle.config import CONFIGS
from gcs_plugin.folder import About


def vehicle_named(about: About, otherwise: str = "") -> str:
    """FILE[:CONFIGURATION] of a dive; `otherwise` where it names none, or one that is not there.

    A file that is not where it was is looked for among those that come with the program. Raises ConfigError where it
    is not there either, and `otherwise` is "".
    """
    if not about.vehicle_file:
        return otherwise
    bundled = replace(about, vehicle_file=str(CONFIGS / "vehicles" / Path(about.vehicle_file).name))
    found = about.vehicle_path or bundled.vehicle_path
    if found is not None:
        return ":".join(filter(None, (str(found), about.configuration)))
    if not otherwise:
        raise ConfigError(
            f"{about.vehicle_file}: the dive's vehicle file is not there; give one with --vehicle"
        )
    return otherwise
