"""Parameter files on their way between `identify` and `params`: any file in, `.param` with its sidecar out."""

import json
from collections.abc import Collection
from importlib.metadata import version
from pathlib import Path
from typing import Any

from bridge.errors import ParamError
from bridge.vehicle.coefficients import BY_NAME
from bridge.vehicle.config import VehicleFile, load_vehicle
from gcs_plugin.params.files import read_parameters, write_parameters
from gcs_plugin.params.sidecar import Sidecar, intervals_of, write_sidecar
from gcs_plugin.params.targets import parameters_from_identification
from identify.identification import Identification
from tui.exit_codes import UsageError


def targets_of(path: Path, vehicle: str | None, only: Collection[str] | None) -> dict[str, float]:
    """Parameter id to value. Raises UsageError for a file that can't be sent: nothing was sent then."""
    try:
        found = _of_identification(path, vehicle) if path.suffix == ".json" else read_parameters(path)
    except ParamError as error:
        raise UsageError(str(error)) from None
    missing = [name for name in only or () if name not in found]
    if missing:
        raise UsageError(f"{path}: has no {', '.join(missing)}; it has {', '.join(sorted(found))}")
    return {name: value for name, value in found.items() if only is None or name in only}


def write_identified(path: Path, answer: Identification, file: VehicleFile) -> None:
    """Write what was identified as a parameter file, and its sidecar beside it. Raises ParamRejected."""
    data = answer.to_json()
    veh_cfg = file.vehicle.veh_cfg(answer.configuration)
    values = parameters_from_identification(data, veh_cfg)
    ids = {name: BY_NAME[name].parameter_id(veh_cfg) for name in answer.values()}
    words = (
        f"{answer.vehicle}, configuration {answer.configuration}, by {answer.method} from {answer.dive}",
    )
    write_parameters(path, values, words)
    write_sidecar(
        path,
        Sidecar(
            answer.dive_sha256,
            answer.vehicle_sha256,
            answer.configuration,
            answer.method,
            version("seatrial"),
            intervals_of(data, ids),
        ),
    )


def _of_identification(path: Path, vehicle: str | None) -> dict[str, float]:
    if vehicle is None:
        raise UsageError(f"{path}: an identification needs --vehicle FILE, to know its VEH_CFG; add it")
    file = load_vehicle(vehicle)
    data = _read(path)
    configuration = file.configuration or file.vehicle.configuration_named(str(data.get("configuration")))
    return parameters_from_identification(data, file.vehicle.veh_cfg(configuration))


def _read(path: Path) -> dict[str, Any]:
    try:
        data = json.loads(path.read_text(encoding="utf-8"))
    except FileNotFoundError:
        raise UsageError(f"{path}: no such file; check the name") from None
    except (OSError, ValueError) as error:
        raise UsageError(
            f"{path}: can't be read as JSON ({error}); give the file that --json wrote"
        ) from None
    if not isinstance(data, dict):
        raise UsageError(f"{path}: holds the results of several dives; identify one dive and give its file")
    return data
