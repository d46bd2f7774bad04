"""The sidecar of a parameter file: a JSON file next to it with the provenance of its values."""

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
from gcs_plugin.params.files import replace_text

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
