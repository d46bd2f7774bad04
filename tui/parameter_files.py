"""Parameter files on their way between `identify` and `params`: any file in, `.param` with its sidecar out."""

import math
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field, replace
from importlib.metadata import version
from pathlib import Path
from typing import TYPE_CHECKING, Any

from bridge.effects.accepted import AcceptedEffect
from bridge.errors import ParamError, ParamUnwritten
from bridge.file_size import read_small
from bridge.parameter_row import to_float32
from bridge.parameters import bounds
from bridge.plain import from_json
from bridge.schema import why_unread
from bridge.vehicle.coefficients import COEFFICIENTS, MASSES, OF_HULL
from bridge.vehicle.config import VehicleFile, load_vehicle
from bridge.vehicle.effect_coefficients import EffectCoefficient, effect_coefficients
from gcs_plugin.params import float32
from gcs_plugin.params.files import found_of, read_parameters, system_of, write_parameters
from gcs_plugin.params.plan import coefficient_of
from gcs_plugin.params.sidecar import Interval, Sidecar, intervals_of, read_sidecar, write_sidecar
from gcs_plugin.params.targets import parameters_from_identification
from identify.identification import Identification, Outcome
from tui.doubted import doubted_in, told
from tui.exit_codes import UsageError

if TYPE_CHECKING:
    from identify.diagnose.result import Diagnosis
    from identify.dive import Dive


@dataclass(frozen=True)
class Targets:
    """What is to be sent: parameter id to value, and what to know of where it came from; `whole`: it is a model, beside
    which no effect that was accepted earlier holds; `left_out` are the lines of the file that were not chosen;
    `sidecar` tells intervals and origin, where it has one; `rigid` mass or inertia of the rigid body and its standard
    deviation, by the id of the total, and `kept` the least and the greatest value that such a vehicle takes, by id,
    where a vehicle file was given; `system` the vehicle that alone may have them."""

    values: dict[str, float]
    notes: tuple[str, ...] = ()
    whole: bool = False
    sidecar: Sidecar | None = None
    left_out: frozenset[str] = frozenset()
    rigid: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    kept: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    system: int | None = None


@dataclass(frozen=True)
class Leave:
    """What the user lets pass: values of another vehicle, values of an identification that did not converge."""

    any_vehicle: bool = False
    doubts: bool = False


def targets_of(
    path: Path, leave: Leave, only: Collection[str] | None = None, vehicle: str | None = None
) -> Targets:
    """The values of a parameter file, and what its sidecar knows of them, where it has one; with a vehicle file, it has
    to be of that vehicle, by its sidecar, else by its own first words.

    Raises UsageError for a file that can't or should not be sent: nothing was sent then.
    """
    try:
        values, sidecar = read_parameters(path), read_sidecar(path)
        system = None if leave.any_vehicle else system_of(path)
        own_words = found_of(path)
    except ParamError as error:
        raise UsageError(str(error)) from None
    file = None if vehicle is None else load_vehicle(vehicle)
    rigid, kept = ({}, {}) if file is None else (_rigid_bodies(file), _kept_by(file))
    warnings: list[str] = []
    if sidecar is None:
        if file is not None and own_words is not None:
            name, shape = own_words
            about = {"vehicle": {"name": name, "sha256": file.sha256}, "configuration": shape}
            warnings = _check_vehicle(path, about, file, leave.any_vehicle)
        return _narrowed(
            path, Targets(values, tuple(warnings), rigid=rigid, kept=kept, system=system), only, {}
        )
    check_outcome(path, sidecar.outcome or Outcome.CONVERGED.value, leave, "sent")
    if file is not None and sidecar.vehicle:
        of = {"name": sidecar.vehicle, "sha256": sidecar.vehicle_sha256}
        about = {"vehicle": of, "configuration": sidecar.configuration}
        warnings = _check_vehicle(path, about, file, leave.any_vehicle)
    notes = (
        *warnings,
        f"from {sidecar.dive or 'a dive'} of {sidecar.vehicle or 'a vehicle'}, configuration "
        f"{sidecar.configuration}, by {sidecar.method}: {sidecar.outcome or 'outcome unknown'}",
    )
    found = Targets(values, notes, True, sidecar, rigid=rigid, kept=kept, system=system)
    return _narrowed(path, found, only, sidecar.doubted)


def targets_of_identification(
    path: Path, vehicle: str | None, leave: Leave, only: Collection[str] | None = None
) -> Targets:
    """The values of the JSON that `identify` wrote. Raises UsageError for one that can't or should not be sent."""
    if vehicle is None:
        raise UsageError(f"{path}: an identification needs --vehicle FILE, to know its VEH_CFG; add it")
    file = load_vehicle(vehicle)
    data = read_identification(path)
    warnings = _check_vehicle(path, data, file, leave.any_vehicle)
    outcome = data["outcome"]
    check_outcome(path, outcome, leave, "sent")
    configuration = file.configuration or file.vehicle.configuration_named(data["configuration"])
    veh_cfg = file.vehicle.veh_cfg(configuration)
    try:
        values = parameters_from_identification(data, veh_cfg)
    except ParamError as error:
        raise UsageError(f"{path}: {error}") from None
    doubts = (f"warning: {doubt['sentence']}" for doubt in data.get("doubts", ()))
    notes = (*warnings, f"outcome: {outcome}", *doubts, *(f"note: {note}" for note in data.get("notes", ())))
    doubted = doubted_in(data)
    sidecar = _sidecar_of(data, {one.name: one.parameter_id(veh_cfg) for one in OF_HULL.values()}, doubted)
    found = Targets(values, notes, True, sidecar, rigid=_rigid_bodies(file), kept=_kept_by(file))
    return _narrowed(path, found, only, doubted)


def _rigid_bodies(file: VehicleFile) -> dict[str, tuple[float, float]]:
    """Mass or inertia of the rigid body and its standard deviation, by the id of each total mass."""
    return {
        one.parameter_id(file.vehicle.veh_cfg(name)): shape.rigid_body(one.dof)
        for name, shape in file.vehicle.configurations.items()
        for one in MASSES
    }


def _kept_by(file: VehicleFile) -> dict[str, tuple[float, float]]:
    """The least and the greatest value of each parameter that a vehicle of this file takes, in any of its shapes."""
    found: dict[str, tuple[float, float]] = {}
    for name, shape in file.vehicle.configurations.items():
        veh_cfg = file.vehicle.veh_cfg(name)
        found |= {one.parameter_id(veh_cfg): bounds(one, shape) for one in COEFFICIENTS}
        of_effects = effect_coefficients(shape)
        found |= {
            one.parameter_id(veh_cfg): (to_float32(one.low), to_float32(one.high)) for one in of_effects
        }
    return found


def _sidecar_of(data: Mapping[str, Any], ids: Mapping[str, str], doubted: dict[str, str]) -> Sidecar:
    """What the sidecar of an identification's values says, from its JSON; `ids`: parameter ids by coefficient."""
    dive = data["dive"] if isinstance(data.get("dive"), dict) else {}
    thrust = data.get("thrust_scale") or {}
    return Sidecar(
        str(dive.get("sha256", "")),
        str(data["vehicle"]["sha256"]),
        data["configuration"],
        str(data.get("method", "")),
        version("seatrial"),
        intervals_of(data, ids),
        str(data["vehicle"]["name"]),
        str(dive.get("name", "")),
        data["outcome"],
        thrust_shift=float(thrust.get("shift", 0.0)),
        dived=str(dive.get("date", "")),
        prior_dives=tuple(map(str, data.get("prior_dives", ()))),
        dive_opening=str(dive.get("opening", "")),
        doubted=doubted,
    )


@dataclass(frozen=True)
class AcceptedModel:
    """A parameter file with its sidecar as a model: by coefficient name values, 95 % intervals, and what speaks against
    values; and the effects."""

    file: VehicleFile
    configuration: str
    values: dict[str, float]
    intervals: dict[str, tuple[float, float]]
    effects: tuple[AcceptedEffect, ...]
    doubted: dict[str, str]


def accepted_model(path: Path, file: VehicleFile, leave: Leave) -> AcceptedModel:
    """The model that `diagnose --accept` or `identify --param` wrote. Raises UsageError for one of another vehicle,
    one without a sidecar, and one that did not converge."""
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
        {one.coefficient: (one.low95, one.high95) for one in sidecar.intervals.values()},
        sidecar.effects,
        sidecar.doubted,
    )


def check_outcome(path: Path, outcome: str, leave: Leave, done: str) -> None:
    """Raise UsageError for an identification that did not converge, unless that may pass; nothing was `done` then."""
    if outcome != Outcome.CONVERGED.value and not leave.doubts:
        raise UsageError(
            f"{path}: the identification ended with '{outcome}', so its values may be wrong: nothing was {done}; "
            "dive again, or give --despite-doubts"
        )


def _narrowed(
    path: Path, found: Targets, only: Collection[str] | None, doubted: Mapping[str, str]
) -> Targets:
    """What is left of the values, and a line for each of these that is doubted."""
    # What it takes back of effects that the vehicle holds may be chosen as well; which these are, the vehicle says.
    missing = [
        name
        for name in only or ()
        if name not in found.values
        and not (found.whole and isinstance(coefficient_of(name), EffectCoefficient))
    ]
    if missing:
        raise UsageError(f"{path}: has no {', '.join(missing)}; it has {', '.join(sorted(found.values))}")
    kept = {name: value for name, value in found.values.items() if only is None or name in only}
    taken = {coefficient.name for name in kept if (coefficient := coefficient_of(name)) is not None}
    notes = (*found.notes, *(f"warning: {line}" for line in told(doubted, taken)))
    return replace(found, values=kept, notes=notes, left_out=frozenset(found.values) - frozenset(kept))


def write_identified(path: Path, answer: Identification, file: VehicleFile) -> None:
    """Write what was identified as a parameter file, and its sidecar beside it. Raises ParamRejected."""
    data = answer.to_json()
    veh_cfg = file.vehicle.veh_cfg(answer.configuration)
    values = parameters_from_identification(data, veh_cfg)
    ids = {name: OF_HULL[name].parameter_id(veh_cfg) for name in answer.values()}
    doubted = {name: why for name, why in doubted_in(data).items() if name in ids}
    words = (
        f"{answer.vehicle}, configuration {answer.configuration}, by {answer.method} from {answer.dive}",
        f"outcome: {answer.outcome.value}",
        *told(doubted, tuple(doubted)),
    )
    _write_both(
        path,
        values,
        words,
        Sidecar(
            answer.dive_sha256,
            answer.vehicle_sha256,
            answer.configuration,
            answer.method,
            version("seatrial"),
            intervals_of(data, ids),
            answer.vehicle,
            answer.dive,
            answer.outcome.value,
            thrust_shift=0.0 if answer.thrust_scale is None else answer.thrust_scale.shift,
            dived=answer.dived,
            prior_dives=answer.prior_dives,
            dive_opening=answer.dive_opening,
            doubted=doubted,
        ),
    )


def write_accepted(
    path: Path,
    found: "Diagnosis",
    dive: "Dive",
    file: VehicleFile,
    doubted: Mapping[str, str],
    by_recording: Outcome,
) -> None:
    """Write what accepting a diagnosis comes to as a parameter file, and its sidecar beside it.

    `doubted`: what the recording says against values, by coefficient, and `by_recording` what that comes to. Where
    something is left that no cause explains, data and model disagree. Raises ParamRejected.
    """
    accepted, configuration = found.accepted, found.configuration
    outcome = Outcome.DISAGREES if found.verdict in ("partly", "unknown") else by_recording
    veh_cfg = file.vehicle.veh_cfg(configuration)
    shape = file.vehicle.configurations[configuration]
    ids = {one.name: one.parameter_id(veh_cfg) for one in COEFFICIENTS}
    ids |= {one.name: one.parameter_id(veh_cfg) for one in effect_coefficients(shape)}
    values = {ids[name]: float32.rounded(one.value) for name, one in accepted.values.items()}
    # What was accepted earlier and is no more is taken back by whatever tool sends the file.
    values |= {i: 0.0 for one in effect_coefficients(shape) if (i := ids[one.name]) not in values}
    names = ", ".join(effect.label for effect in accepted.effects)
    words = (
        f"{file.vehicle.name}, configuration {configuration}, by diagnose from {dive.name}",
        f"accepted: {names}",
        f"outcome: {outcome.value}",
        *told(doubted, tuple(doubted)),
    )
    _write_both(
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
                ids[name]: Interval(name, one.unit, one.low95, one.high95)
                for name, one in accepted.values.items()
                if math.isfinite(one.low95) and math.isfinite(one.high95)
            },
            file.vehicle.name,
            dive.name,
            outcome.value,
            dive_opening=dive.opening,
            effects=accepted.effects,
            doubted=dict(doubted),
        ),
    )


def _write_both(path: Path, values: Mapping[str, float], words: Sequence[str], sidecar: Sidecar) -> None:
    """A parameter file with its sidecar, or none: without it, nothing would tell of its doubts any more."""
    write_parameters(path, values, words)
    try:
        write_sidecar(path, sidecar)
    except ParamUnwritten:
        path.unlink(missing_ok=True)
        raise


def _check_vehicle(path: Path, data: Mapping[str, Any], file: VehicleFile, any_vehicle: bool) -> list[str]:
    """What to warn of. Raises UsageError where the values belong to another vehicle or another shape of it."""
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
    """An identification's JSON with all that is used here. Raises UsageError for another file."""
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
        and _is_number(thrust.get("shift", 0.0))
    )


def _is_doubt(data: Any) -> bool:
    return isinstance(data, dict) and "sentence" in data and isinstance(data.get("about", []), list)


def _is_estimate(data: Any) -> bool:
    return (
        isinstance(data, dict)
        and isinstance(data.get("name"), str)
        and all(data.get(key) is None or _is_number(data[key]) for key in ("low95", "high95"))
    )


def _is_number(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool) and math.isfinite(value)


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
