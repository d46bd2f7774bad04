"""The sidecar of a parameter file: JSON beside it that says where its values came from."""

import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any, Final

from bridge import schema
from bridge.effects.accepted import AcceptedEffect
from bridge.errors import ConfigError, ParamRejected
from bridge.file_size import read_small
from bridge.plain import from_json
from gcs_plugin.params.files import replace_text

FORMAT: Final = 1


@dataclass(frozen=True)
class Interval:
    """Where a value came from and how sure it is: 95 % interval in `unit`."""

    coefficient: str
    unit: str
    low95: float
    high95: float


@dataclass(frozen=True)
class Sidecar:
    """Provenance of a `.param`: hashes of dive and vehicle file, method, version, intervals by id, outcome.

    `thrust_shift` (relative) is what a weighed prior made of the thrust, which the values have in them; `dived` a date;
    `prior_dives` the earlier dives that priors brought into the values; `effects` what the model has beyond its
    coefficients, those included that no parameter holds; `doubted` what speaks against values, by coefficient.
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
    """Write the sidecar of the parameter file `path` and return where it lies."""
    beside = sidecar_path(path)
    replace_text(beside, json.dumps(asdict(sidecar), indent=2, allow_nan=False) + "\n")
    return beside


def read_sidecar(path: Path) -> Sidecar | None:
    """The sidecar of the parameter file `path`, None without one. Raises ParamRejected for a damaged one."""
    beside = sidecar_path(path)
    if not beside.exists():
        return None
    try:
        data: Any = from_json(read_small(beside))
        return schema.build(Sidecar, data, str(beside))
    except (OSError, ValueError, ConfigError) as error:
        raise ParamRejected(f"{beside}: not a sidecar ({error}); remove it or identify again") from None


def unchecked(path: Path, sidecar: Sidecar | None) -> tuple[str, ...]:
    """What could not be checked of a parameter file since no sidecar lies beside it; nothing where one does."""
    if sidecar is not None:
        return ()
    return (
        f"note: vehicle file and intervals of {path.name} could not be checked: {sidecar_path(path).name} "
        "is not beside it",
    )


def intervals_of(identification: Mapping[str, Any], parameter_ids: Mapping[str, str]) -> dict[str, Interval]:
    """The intervals of an identification's JSON, by parameter id; `parameter_ids`: coefficient name to id."""
    found = {}
    for estimate in identification.get("parameters", []):
        name = estimate.get("name")
        if name in parameter_ids and estimate.get("low95") is not None and estimate.get("high95") is not None:
            found[parameter_ids[name]] = Interval(
                name, str(estimate.get("unit", "")), float(estimate["low95"]), float(estimate["high95"])
            )
    return found
