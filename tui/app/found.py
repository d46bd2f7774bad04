"""What was identified from a dive, as `seatrial identify --json` left it beside it, and what was accepted before."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from bridge.errors import ParamError
from bridge.file_size import read_small
from bridge.plain import from_json
from bridge.vehicle.coefficients import OF_HULL
from gcs_plugin.params.files import read_parameters
from gcs_plugin.params.last_accepted import last_accepted
from gcs_plugin.params.plan import coefficient_of

JSON, PARAM, PAGE = "identified.json", "identified.param", "identified.html"


@dataclass(frozen=True)
class Value:
    """One parameter in `unit`, NaN where it could not be told, with its 95 % interval; `reason` says why not.

    `accepted` is what the vehicle last accepted, NaN for nothing.
    """

    name: str
    unit: str
    value: float
    low95: float
    high95: float
    reason: str
    accepted: float = math.nan

    @property
    def change(self) -> float:
        """Relative to what was last accepted."""
        return self.value / self.accepted - 1 if self.accepted else math.nan

    @property
    def is_news(self) -> bool:
        """Whether what was last accepted lies outside the interval."""
        return not self.low95 <= self.accepted <= self.high95 and math.isfinite(self.accepted)


@dataclass(frozen=True)
class Found:
    """The result of one dive; `beside` is what a second method said, `param` the file to upload, None for none."""

    dive: str
    configuration: str
    method: str
    outcome: str
    values: tuple[Value, ...]
    doubts: tuple[str, ...]
    notes: tuple[str, ...]
    beside: tuple[str, ...]
    param: Path | None
    written_unix_s: float

    @property
    def coefficients(self) -> tuple[Value, ...]:
        """The values but for those that follow from others."""
        return tuple(one for one in self.values if one.name in OF_HULL)

    @property
    def told(self) -> int:
        """How many of the coefficients have a value."""
        return sum(math.isfinite(one.value) for one in self.coefficients)


def places(dive: Path) -> dict[str, Path]:
    """Where the result of a dive lies, by its option; beside a recording that is no folder, under its own name."""
    names = {"--json": JSON, "--param": PARAM, "--report": PAGE}
    return {
        option: dive / name if dive.is_dir() else dive.with_name(f"{dive.stem}-{name}")
        for option, name in names.items()
    }


def found(dive: Path, receipts: Path, unkept: Any = None) -> Found | None:
    """What was identified from it; None where nothing was, or the file is something else.

    `unkept` is what was identified just now and could not be written there. It has no parameters to upload: those that
    lie there are of an earlier one, or have nothing beside them that tells of them.
    """
    at = places(dive)
    try:
        if unkept is not None:
            return _found(unkept, accepted_before(at["--param"], receipts), None, math.nan)
        data = from_json(read_small(at["--json"]))
        written = at["--json"].stat()
        param = _no_older(at["--param"], written.st_mtime_ns)
        return _found(data, accepted_before(at["--param"], receipts), param, written.st_mtime)
    except (OSError, ValueError, KeyError, TypeError):
        return None


def _no_older(param: Path, than_ns: int) -> Path | None:
    """An identification that told nothing writes no parameters: those that lie there are then of an earlier one."""
    return param if param.exists() and param.stat().st_mtime_ns >= than_ns else None


def accepted_before(param: Path, receipts: Path) -> dict[str, float]:
    """What was last accepted, by coefficient, for the configuration that `param` is of."""
    try:
        ids = read_parameters(param)
    except ParamError:
        return {}
    accepted = last_accepted(receipts)
    known = {name: coefficient_of(name) for name in ids if name in accepted}
    return {one.name: accepted[name].value for name, one in known.items() if one is not None}


def _found(
    data: Mapping[str, Any], accepted: Mapping[str, float], param: Path | None, written_unix_s: float
) -> Found:
    doubts = tuple(dict.fromkeys(str(doubt["sentence"]) for doubt in data["doubts"]))
    scale = data["thrust_scale"]
    told = [one["sentence"] for one in (*data["null_directions"], *([scale] if scale else []))]
    notes = dict.fromkeys((*told, *data["notes"]))
    second = data.get("comparison")
    return Found(
        str(data["dive"]["name"]),
        str(data["configuration"]),
        str(data["method"]),
        str(data["outcome"]),
        tuple(_value(one, accepted) for one in data["parameters"]),
        doubts,
        tuple(str(note) for note in notes if note not in doubts),
        (f"{second['method']}: {second['outcome']}", *map(str, second["sentences"])) if second else (),
        param,
        written_unix_s,
    )


def _value(data: Mapping[str, Any], accepted: Mapping[str, float]) -> Value:
    numbers = (data["value"], data["low95"], data["high95"])
    value, low, high = (
        math.nan if one is None or not data["identifiable"] else float(one) for one in numbers
    )
    name = str(data["name"])
    return Value(
        name, str(data["unit"]), value, low, high, data.get("reason", ""), accepted.get(name, math.nan)
    )
