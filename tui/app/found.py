"""Results that `seatrial identify --json` left next to a dive, together with the values accepted before."""

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
    """One parameter in `unit`, NaN if not identified, with its 95 % interval; `reason` says why it was not.

    `accepted` is the value that the vehicle last accepted, NaN for none.
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
        """Relative change from the last accepted value."""
        return self.value / self.accepted - 1 if self.accepted else math.nan

    @property
    def is_news(self) -> bool:
        """Whether the last accepted value lies outside the interval."""
        return not self.low95 <= self.accepted <= self.high95 and math.isfinite(self.accepted)


@dataclass(frozen=True)
class Found:
    """The result of one dive; `beside` holds the second method's results, `param` the file to upload, None for none."""

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
        """The values without those derived from others."""
        return tuple(value for value in self.values if value.name in OF_HULL)

    @property
    def told(self) -> int:
        """Number of coefficients that have a value."""
        return sum(math.isfinite(value.value) for value in self.coefficients)


def places(dive: Path) -> dict[str, Path]:
    """Result files of a dive by option; for a recording that is not a folder, next to it with its name as a prefix."""
    names = {"--json": JSON, "--param": PARAM, "--report": PAGE}
    return {
        option: dive / name if dive.is_dir() else dive.with_name(f"{dive.stem}-{name}")
        for option, name in names.items()
    }


def found(dive: Path, receipts: Path, unkept: Any = None) -> Found | None:
    """Load the identification of a dive; None if it is missing or not an identification.

    `unkept` is a new result that could not be written there. It has no parameters to upload: any file there belongs
    to an earlier result, or lacks a matching result.
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
    """The parameter file unless it is older: an identification without values writes none and leaves an old one."""
    return param if param.exists() and param.stat().st_mtime_ns >= than_ns else None


def accepted_before(param: Path, receipts: Path) -> dict[str, float]:
    """Last accepted values by coefficient, for the configuration of the file `param`."""
    try:
        ids = read_parameters(param)
    except ParamError:
        return {}
    accepted = last_accepted(receipts)
    known = {name: coefficient_of(name) for name in ids if name in accepted}
    return {
        coefficient.name: accepted[name].value
        for name, coefficient in known.items()
        if coefficient is not None
    }


def _found(
    data: Mapping[str, Any], accepted: Mapping[str, float], param: Path | None, written_unix_s: float
) -> Found:
    doubts = tuple(dict.fromkeys(str(doubt["sentence"]) for doubt in data["doubts"]))
    scale = data["thrust_scale"]
    sentences = [entry["sentence"] for entry in (*data["null_directions"], *([scale] if scale else []))]
    notes = dict.fromkeys((*sentences, *data["notes"]))
    second = data.get("comparison")
    return Found(
        str(data["dive"]["name"]),
        str(data["configuration"]),
        str(data["method"]),
        str(data["outcome"]),
        tuple(_value(entry, accepted) for entry in data["parameters"]),
        doubts,
        tuple(str(note) for note in notes if note not in doubts),
        (f"{second['method']}: {second['outcome']}", *map(str, second["sentences"])) if second else (),
        param,
        written_unix_s,
    )


def _value(data: Mapping[str, Any], accepted: Mapping[str, float]) -> Value:
    numbers = (data["value"], data["low95"], data["high95"])
    value, low, high = (
        math.nan if number is None or not data["identifiable"] else float(number) for number in numbers
    )
    name = str(data["name"])
    return Value(
        name, str(data["unit"]), value, low, high, data.get("reason", ""), accepted.get(name, math.nan)
    )
