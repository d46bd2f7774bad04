"""The sidecar of a parameter file: a JSON file next to it with the provenance of its values.

Here too: reading both for an upload, with the warnings that the sidecar gives rise to.
"""

import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any, Final

from bridge import schema
from bridge.errors import ConfigError, ParamRejected
from bridge.file_size import read_small
from bridge.plain import from_json
from bridge.vehicle.accepted_effect import AcceptedEffect
from gcs_plugin.params.files import read_parameters, replace_text, system_of
from gcs_plugin.params.plan import coefficient_of

FORMAT: Final = 1


@dataclass(frozen=True)
class Interval:
    """The coefficient behind a value and its 95 % interval, in `unit`."""

    coefficient: str
    unit: str
    low95: float
    high95: float


@dataclass(frozen=True)
class Sidecar:
    """Provenance of a `.param`: hashes of dive and vehicle file, method, version, intervals by parameter id, outcome.

    `thrust_shift` is the relative change of the thrust by a weighed prior, already contained in the values; `dived` is
    the date of the dive; `prior_dives` are the earlier dives that entered the values through priors; `effects` are the
    model's effects beyond its coefficients, including effects that no parameter holds; `doubted` gives reasons to doubt
    a value, by coefficient.
    """

    dive_sha256: str
    vehicle_sha256: str
    configuration: str
    method: str
    version: str
    intervals: dict[str, Interval] = field(default_factory=dict)
    vehicle: str = ""
    dive: str = ""
    outcome: str = ""
    format: int = FORMAT
    thrust_shift: float = 0.0
    dived: str = ""
    prior_dives: tuple[str, ...] = ()
    dive_opening: str = ""
    effects: tuple[AcceptedEffect, ...] = ()
    doubted: dict[str, str] = field(default_factory=dict)


def sidecar_path(path: Path) -> Path:
    """`hovering.param` -> `hovering.param.json`."""
    return path.with_name(path.name + ".json")


def write_sidecar(path: Path, sidecar: Sidecar) -> Path:
    """Write the sidecar of the parameter file `path` and return the sidecar's path."""
    target = sidecar_path(path)
    replace_text(target, json.dumps(asdict(sidecar), indent=2, allow_nan=False) + "\n")
    return target


def read_sidecar(path: Path) -> Sidecar | None:
    """Read the sidecar of the parameter file `path`; None if it has none. Raises ParamRejected if it is damaged."""
    source = sidecar_path(path)
    if not source.exists():
        return None
    try:
        data: Any = from_json(read_small(source))
        return schema.build(Sidecar, data, str(source))
    except (OSError, ValueError, ConfigError) as error:
        raise ParamRejected(f"{source}: not a sidecar ({error}); remove it or identify again") from None


def unchecked(path: Path, sidecar: Sidecar | None) -> tuple[str, ...]:
    """Note about the checks that a missing sidecar makes impossible; empty if the parameter file has a sidecar."""
    if sidecar is not None:
        return ()
    return (
        f"note: vehicle file and intervals of {path.name} could not be checked: {sidecar_path(path).name} "
        "is not beside it",
    )


def intervals_of(identification: Mapping[str, Any], parameter_ids: Mapping[str, str]) -> dict[str, Interval]:
    """95 % intervals from an identification's JSON, by parameter id; `parameter_ids` maps coefficient name to id."""
    intervals = {}
    for estimate in identification.get("parameters", []):
        name = estimate.get("name")
        if name in parameter_ids and estimate.get("low95") is not None and estimate.get("high95") is not None:
            intervals[parameter_ids[name]] = Interval(
                name, str(estimate.get("unit", "")), float(estimate["low95"]), float(estimate["high95"])
            )
    return intervals


CONVERGED: Final = "converged"


@dataclass(frozen=True)
class Wanted:
    """Values of a parameter file, by parameter id.

    `notes` are lines for the operator; `whole`: the file is a complete model, which invalidates effects accepted
    earlier; `sidecar` is its provenance; `system` is the MAVLink system that the file was saved from, None if it names
    none.
    """

    values: dict[str, float]
    notes: tuple[str, ...] = ()
    whole: bool = False
    sidecar: Sidecar | None = None
    system: int | None = None


def wanted_by(path: Path, despite_doubts: bool) -> Wanted:
    """Read a parameter file and its sidecar.

    Raises ParamRejected for a damaged file, and for an identification that did not converge unless `despite_doubts`.
    """
    if path.suffix == ".json":
        raise ParamRejected(
            f"{path}: is no parameter file; give the .param that `seatrial identify --param` wrote"
        )
    values, sidecar, system = read_parameters(path), read_sidecar(path), system_of(path)
    if sidecar is None:
        return Wanted(values, system=system)
    outcome = sidecar.outcome or CONVERGED
    if outcome != CONVERGED and not despite_doubts:
        raise ParamRejected(
            f"{path}: the identification ended with '{outcome}', so its values may be wrong: nothing was sent; "
            "dive again, or add despite-doubts"
        )
    named = {c.name: name for name in values if (c := coefficient_of(name)) is not None}
    return Wanted(
        values,
        (
            f"from {sidecar.dive or 'a dive'} of {sidecar.vehicle or 'a vehicle'}, configuration "
            f"{sidecar.configuration}, by {sidecar.method}: {outcome}",
            *(f"warning: {named[name]}: {why}" for name, why in sidecar.doubted.items() if name in named),
        ),
        True,
        sidecar,
        system,
    )
