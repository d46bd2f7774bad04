"""Files that hold a model: the JSON of `identify`, and a `.param` with its sidecar. Read, and checked to be fit."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from bridge.errors import ParamError
from bridge.exit_codes import UsageError
from bridge.files import read_small
from bridge.plain import from_json, is_number
from bridge.schema import why_unread
from bridge.vehicle.config import VehicleFile
from gcs_plugin.params.files import read_parameters
from gcs_plugin.params.meaning import coefficient_of
from gcs_plugin.params.sidecar import Sidecar, read_sidecar
from identify.doubt import Outcome
from identify.validation.against_forecast import Foretelling


@dataclass(frozen=True)
class Leave:
    """Checks that the user waives: values of another vehicle, values of an identification that did not converge."""

    any_vehicle: bool = False
    doubts: bool = False


def accepted_model(path: Path, file: VehicleFile, leave: Leave) -> tuple[dict[str, float], Sidecar]:
    """The model that `diagnose --accept` or `identify --param` wrote: values by coefficient, and the sidecar.

    Raises UsageError for a model of another vehicle, without a sidecar, or of an identification that did not
    converge.
    """
    try:
        values = read_parameters(path)
    except ParamError as error:
        raise UsageError(str(error)) from None
    sidecar = sidecar_of_file(path)
    if sidecar is None:
        raise UsageError(
            f"{path}: has no sidecar that says of which vehicle it is; give one with {path.name}.json"
        )
    check_outcome(path, sidecar.outcome or Outcome.CONVERGED.value, leave, "written")
    check_vehicle(path, sidecar.vehicle, sidecar.configuration, file)
    named = {name: coefficient for name in values if (coefficient := coefficient_of(name)) is not None}
    return {coefficient.name: values[name] for name, coefficient in named.items() if values[name]}, sidecar


def foretelling_of(sidecar: Sidecar) -> Foretelling | None:
    """The parts of a sidecar about the next dive; None if it has none."""
    if not sidecar.foretold and not sidecar.credits:
        return None
    return Foretelling(
        sidecar.vehicle,
        sidecar.configuration,
        sidecar.dive,
        sidecar.dive_sha256,
        sidecar.dived,
        tuple(effect.label for effect in sidecar.effects),
        sidecar.foretold,
        sidecar.credits,
    )


def sidecar_of_file(path: Path) -> Sidecar | None:
    """The sidecar of a parameter file; None if it has none. Raises UsageError for a damaged one."""
    try:
        return read_sidecar(path)
    except ParamError as error:
        raise UsageError(str(error)) from None


def check_vehicle(path: Path, vehicle: str, configuration: str, file: VehicleFile) -> None:
    """Raise UsageError for a model of another vehicle than that of `file`, or of another configuration."""
    if vehicle != file.vehicle.name or file.configuration not in (None, configuration):
        raise UsageError(
            f"{path}: is of vehicle '{vehicle}', configuration '{configuration}', and {file.path} is not: nothing was "
            "written; name its own"
        )
    file.vehicle.configuration_named(configuration)


def check_outcome(path: Path, outcome: str, leave: Leave, done: str) -> None:
    """Raise UsageError for an identification that did not converge, unless that is waived; nothing was `done` then."""
    if outcome != Outcome.CONVERGED.value and not leave.doubts:
        raise UsageError(
            f"{path}: the identification ended with '{outcome}', so its values may be wrong: nothing was {done}; "
            "dive again, or give --despite-doubts"
        )


def read_identification(path: Path) -> dict[str, Any]:
    """Read an identification's JSON and check the parts used here. Raises UsageError for another file."""
    data = read_json(path)
    if not _is_identification(data):
        raise UsageError(
            f"{path}: is not an identification; give the file that `seatrial identify --json` wrote"
        )
    return data


def _is_identification(data: Mapping[str, Any]) -> bool:
    vehicle, thrust = data.get("vehicle"), data.get("thrust_scale") or {}
    return (
        all(isinstance(data.get(key, []), list) for key in ("notes", "doubts", "prior_dives"))
        and all(isinstance(data.get(key), str) for key in ("configuration", "outcome"))
        and isinstance(data.get("parameters"), list)
        and all(map(_is_estimate, data["parameters"]))
        and all(map(_is_doubt, data.get("doubts", [])))
        and isinstance(vehicle, dict)
        and {"name", "sha256"} <= set(vehicle)
        and isinstance(thrust, dict)
        and is_number(thrust.get("shift", 0.0))
    )


def _is_doubt(data: Any) -> bool:
    return isinstance(data, dict) and "sentence" in data and isinstance(data.get("about", []), list)


NUMBERS = ("value", "low95", "high95", "given_thrust_low95", "given_thrust_high95")


def _is_estimate(data: Any) -> bool:
    return (
        isinstance(data, dict)
        and isinstance(data.get("name"), str)
        and all(data.get(key) is None or is_number(data[key]) for key in NUMBERS)
    )


def read_json(path: Path) -> dict[str, Any]:
    """Read the JSON that a verb wrote of one dive. Raises UsageError for another file."""
    try:
        data = from_json(read_small(path))
    except FileNotFoundError:
        raise UsageError(f"{path}: no such file; check the name") from None
    except (OSError, UnicodeDecodeError) as error:
        raise UsageError(f"{path}: {why_unread(error)}; give the file that --json wrote") from None
    except ValueError:
        raise UsageError(f"{path}: is no JSON; give the file that --json wrote") from None
    if isinstance(data, list):
        raise UsageError(f"{path}: holds the results of several dives; identify one dive and give its file")
    if not isinstance(data, dict):
        raise UsageError(f"{path}: holds no result of a dive; give the file that --json wrote")
    return data
