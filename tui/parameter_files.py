"""Parameter files between `identify` and `params`: read any of their files, write `.param` with its sidecar."""

import math
from collections.abc import Collection, Mapping
from dataclasses import dataclass, replace
from importlib.metadata import version
from pathlib import Path
from typing import TYPE_CHECKING, Any

from bridge.errors import ParamError
from bridge.exit_codes import UsageError
from bridge.files import read_small
from bridge.plain import from_json, is_number
from bridge.schema import why_unread
from bridge.vehicle.coefficients import COEFFICIENTS, MASSES, OF_HULL
from bridge.vehicle.config import VehicleFile, load_vehicle
from bridge.vehicle.effect_coefficients import AcceptedEffect, effect_coefficients
from bridge.vehicle.parameters import bounds, to_float32
from gcs_plugin.params import float32
from gcs_plugin.params.comparison import Wanted, wanted_by
from gcs_plugin.params.files import (
    Interval,
    Sidecar,
    read_parameters,
    read_sidecar,
)
from gcs_plugin.params.identified import (
    doubt_lines,
    doubted_in,
    origin,
    origin_in,
    parameters_from_identification,
    sidecar_of,
    write_with_sidecar,
)
from gcs_plugin.params.plan import coefficient_of
from identify.identification import Outcome

if TYPE_CHECKING:
    from identify.diagnose.result import Diagnosis
    from identify.dive import Dive


@dataclass(frozen=True)
class Leave:
    """Checks that the user waives: values of another vehicle, values of an identification that did not converge."""

    any_vehicle: bool = False
    doubts: bool = False


def targets_of(
    path: Path, leave: Leave, only: Collection[str] | None = None, vehicle: str | None = None
) -> Wanted:
    """Read a parameter file with its sidecar, if it has one.

    If `vehicle` names a vehicle file, the values must be of that vehicle, by the sidecar or else by the file's own
    header. Raises UsageError for a file that can't or should not be sent: nothing was sent then.
    """
    file = None if vehicle is None else load_vehicle(vehicle)
    try:
        wanted = wanted_by(
            path, "--despite-doubts", despite_doubts=leave.doubts, any_vehicle=leave.any_vehicle
        )
        own_words = origin_in(path)
        if file is not None:
            about = None
            if wanted.sidecar is None and own_words is not None:
                about = {
                    "vehicle": {"name": own_words[0], "sha256": file.sha256},
                    "configuration": own_words[1],
                }
            elif wanted.sidecar is not None and wanted.sidecar.vehicle:
                owner = {"name": wanted.sidecar.vehicle, "sha256": wanted.sidecar.vehicle_sha256}
                about = {"vehicle": owner, "configuration": wanted.sidecar.configuration}
            warnings = () if about is None else _check_vehicle(path, about, file, leave.any_vehicle)
            wanted = replace(
                wanted, notes=(*warnings, *wanted.notes), rigid=_rigid_bodies(file), kept=_kept_by(file)
            )
        return wanted.narrowed(path, only)
    except ParamError as error:
        raise UsageError(str(error)) from None


def targets_of_identification(
    path: Path, vehicle: str | None, leave: Leave, only: Collection[str] | None = None
) -> Wanted:
    """Values of the JSON that `identify` wrote. Raises UsageError for a file that can't or should not be sent."""
    if vehicle is None:
        raise UsageError(f"{path}: an identification needs --vehicle FILE, to know its VEH_CFG; add it")
    file = load_vehicle(vehicle)
    data = read_identification(path)
    warnings = _check_vehicle(path, data, file, leave.any_vehicle)
    outcome = data["outcome"]
    check_outcome(path, outcome, leave, "sent")
    configuration = file.configuration or file.vehicle.configuration_named(data["configuration"])
    veh_cfg = file.vehicle.veh_cfg(configuration)
    doubts = (f"warning: {doubt['sentence']}" for doubt in data.get("doubts", ()))
    notes = (*warnings, f"outcome: {outcome}", *doubts, *(f"note: {note}" for note in data.get("notes", ())))
    doubted = doubted_in(data)
    sidecar = sidecar_of(data, {c.name: c.parameter_id(veh_cfg) for c in OF_HULL.values()}, doubted)
    try:
        values = parameters_from_identification(data, veh_cfg)
        wanted = Wanted(values, notes, True, sidecar, rigid=_rigid_bodies(file), kept=_kept_by(file))
    except ParamError as error:
        raise UsageError(f"{path}: {error}") from None
    try:
        return wanted.narrowed(path, only)
    except ParamError as error:
        raise UsageError(str(error)) from None


def _rigid_bodies(file: VehicleFile) -> dict[str, tuple[float, float]]:
    """Mass or inertia of the rigid body and its standard deviation, by the id of each total mass."""
    return {
        mass.parameter_id(file.vehicle.veh_cfg(name)): shape.rigid_body(mass.dof)
        for name, shape in file.vehicle.configurations.items()
        for mass in MASSES
    }


def _kept_by(file: VehicleFile) -> dict[str, tuple[float, float]]:
    """The least and the greatest value of each parameter that a vehicle of this file takes, in any configuration."""
    limits: dict[str, tuple[float, float]] = {}
    for name, shape in file.vehicle.configurations.items():
        veh_cfg = file.vehicle.veh_cfg(name)
        limits |= {c.parameter_id(veh_cfg): bounds(c, shape) for c in COEFFICIENTS}
        of_effects = effect_coefficients(shape)
        limits |= {c.parameter_id(veh_cfg): (to_float32(c.low), to_float32(c.high)) for c in of_effects}
    return limits


@dataclass(frozen=True)
class AcceptedModel:
    """A parameter file with its sidecar as a model: values, 95 % intervals and doubts by coefficient; effects."""

    file: VehicleFile
    configuration: str
    values: dict[str, float]
    intervals: dict[str, tuple[float, float]]
    effects: tuple[AcceptedEffect, ...]
    doubted: dict[str, str]


def accepted_model(path: Path, file: VehicleFile, leave: Leave) -> AcceptedModel:
    """The model that `diagnose --accept` or `identify --param` wrote.

    Raises UsageError for a model of another vehicle, without a sidecar, or of an identification that did not
    converge.
    """
    try:
        values, sidecar = read_parameters(path), read_sidecar(path)
    except ParamError as error:
        raise UsageError(str(error)) from None
    if sidecar is None:
        raise UsageError(
            f"{path}: has no sidecar that says of which vehicle it is; give one with {path.name}.json"
        )
    check_outcome(path, sidecar.outcome or Outcome.CONVERGED.value, leave, "written")
    if sidecar.vehicle != file.vehicle.name or file.configuration not in (None, sidecar.configuration):
        raise UsageError(
            f"{path}: is of vehicle '{sidecar.vehicle}', configuration '{sidecar.configuration}', and {file.path} is "
            "not: nothing was written; name its own"
        )
    file.vehicle.configuration_named(sidecar.configuration)
    named = {name: coefficient for name in values if (coefficient := coefficient_of(name)) is not None}
    return AcceptedModel(
        file,
        sidecar.configuration,
        {coefficient.name: values[name] for name, coefficient in named.items() if values[name]},
        {interval.coefficient: (interval.low95, interval.high95) for interval in sidecar.intervals.values()},
        sidecar.effects,
        sidecar.doubted,
    )


def check_outcome(path: Path, outcome: str, leave: Leave, done: str) -> None:
    """Raise UsageError for an identification that did not converge, unless that is waived; nothing was `done` then."""
    if outcome != Outcome.CONVERGED.value and not leave.doubts:
        raise UsageError(
            f"{path}: the identification ended with '{outcome}', so its values may be wrong: nothing was {done}; "
            "dive again, or give --despite-doubts"
        )


def write_accepted(
    path: Path,
    diagnosis: "Diagnosis",
    dive: "Dive",
    file: VehicleFile,
    doubted: Mapping[str, str],
    by_recording: Outcome,
) -> None:
    """Write the result of accepting a diagnosis as a parameter file with its sidecar.

    `doubted`: the recording's evidence against values, by coefficient, and `by_recording` the outcome it leads to. If
    a gap is left that no cause explains, the outcome is that data and model disagree. Raises ParamRejected.
    """
    accepted, configuration = diagnosis.accepted, diagnosis.configuration
    outcome = Outcome.DISAGREES if diagnosis.verdict in ("partly", "unknown") else by_recording
    veh_cfg = file.vehicle.veh_cfg(configuration)
    shape = file.vehicle.configurations[configuration]
    ids = {item.name: item.parameter_id(veh_cfg) for item in COEFFICIENTS}
    ids |= {item.name: item.parameter_id(veh_cfg) for item in effect_coefficients(shape)}
    values = {ids[name]: float32.rounded(item.value) for name, item in accepted.values.items()}
    # Zero takes back an effect that was accepted earlier and is no longer, whichever tool sends the file.
    values |= {i: 0.0 for item in effect_coefficients(shape) if (i := ids[item.name]) not in values}
    names = ", ".join(effect.label for effect in accepted.effects)
    words = (
        origin(file.vehicle.name, configuration, "diagnose", dive.name),
        f"accepted: {names}",
        f"outcome: {outcome.value}",
        *doubt_lines(doubted, tuple(doubted)),
    )
    write_with_sidecar(
        path,
        values,
        words,
        Sidecar(
            dive.sha256,
            file.sha256,
            configuration,
            "diagnose",
            version("seatrial"),
            {
                ids[name]: Interval(name, item.unit, item.low95, item.high95)
                for name, item in accepted.values.items()
                if math.isfinite(item.low95) and math.isfinite(item.high95)
            },
            file.vehicle.name,
            dive.name,
            outcome.value,
            dive_opening=dive.opening,
            effects=accepted.effects,
            doubted=dict(doubted),
        ),
    )


def _check_vehicle(path: Path, data: Mapping[str, Any], file: VehicleFile, any_vehicle: bool) -> list[str]:
    """Return warnings. Raises UsageError if the values belong to another vehicle or another configuration of it."""
    name, shape = data["vehicle"]["name"], data["configuration"]
    misfits = []
    if name != file.vehicle.name:
        misfits.append(f"is of vehicle '{name}', and {file.path} is of '{file.vehicle.name}'")
    if file.configuration not in (None, shape):
        misfits.append(f"is of configuration '{shape}', and --vehicle names '{file.configuration}'")
    if misfits and not any_vehicle:
        raise UsageError(
            f"{path}: {'; it '.join(misfits)}: nothing was sent; name its own vehicle, or give --any-vehicle"
        )
    warnings = [f"warning: {path} {misfit}" for misfit in misfits]
    if not misfits and data["vehicle"]["sha256"] != file.sha256:
        warnings.append(f"warning: {file.path} has changed since {path} was identified with it")
    return warnings


def read_identification(path: Path) -> dict[str, Any]:
    """Read an identification's JSON and check the parts used here. Raises UsageError for another file."""
    data = _read(path)
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


def _is_estimate(data: Any) -> bool:
    return (
        isinstance(data, dict)
        and isinstance(data.get("name"), str)
        and all(data.get(key) is None or is_number(data[key]) for key in ("low95", "high95"))
    )


def _read(path: Path) -> dict[str, Any]:
    try:
        data = from_json(read_small(path))
    except FileNotFoundError:
        raise UsageError(f"{path}: no such file; check the name") from None
    except (OSError, UnicodeDecodeError) as error:
        raise UsageError(f"{path}: {why_unread(error)}; give the file that --json wrote") from None
    except ValueError:
        raise UsageError(f"{path}: is no JSON; give the file that --json wrote") from None
    if not isinstance(data, dict):
        raise UsageError(f"{path}: holds the results of several dives; identify one dive and give its file")
    return data
