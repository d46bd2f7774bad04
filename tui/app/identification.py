"""An identification as `seatrial identify` left it beside its dive, with the values accepted before."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from bridge.errors import ParamError
from bridge.files import written_ns
from bridge.vehicle.coefficients import OF_HULL
from gcs_plugin.params.files import read_parameters
from gcs_plugin.params.last_accepted import accepted_of
from gcs_plugin.params.meaning import coefficient_of
from tui.app.jobs import json_in, newer
from tui.dive_list import results_beside


@dataclass(frozen=True)
class Value:
    """One parameter in `unit`, NaN if not identified, with its 95 % interval; `reason` says why it was not.

    `given` is the interval given the vehicle file's thrust, the other holds the thrust's uncertainty.
    `accepted` is the value that the vehicle last accepted, NaN for none.
    """

    name: str
    unit: str
    value: float
    low95: float
    high95: float
    given: tuple[float, float]
    reason: str
    accepted: float = math.nan

    @property
    def change(self) -> float:
        """Relative change from the last accepted value."""
        return self.value / self.accepted - 1 if self.accepted else math.nan

    @property
    def is_news(self) -> bool:
        """Whether the last accepted value lies outside the interval given the thrust, which acts on both alike."""
        low, high = self.given
        return not low <= self.accepted <= high and math.isfinite(self.accepted)


@dataclass(frozen=True)
class Comparison:
    """The second method: its outcome, and where it agrees with the first."""

    method: str
    outcome: str
    sentences: tuple[str, ...]


@dataclass(frozen=True)
class Identified:
    """The identification of a dive; `comparison` is None without a second method, `param` without a file to upload."""

    dive: str
    configuration: str
    method: str
    outcome: str
    values: tuple[Value, ...]
    doubts: tuple[str, ...]
    notes: tuple[str, ...]
    comparison: Comparison | None
    param: Path | None
    written_unix_s: float

    @property
    def coefficients(self) -> tuple[Value, ...]:
        """The values without those derived from others."""
        return tuple(value for value in self.values if value.name in OF_HULL)

    @property
    def count(self) -> int:
        """Number of coefficients that have a value."""
        return sum(math.isfinite(value.value) for value in self.coefficients)


def load_identified(dive: Path, receipts: Path, unkept: Any = None) -> Identified | None:
    """Load the identification of a dive; None if it is missing or not an identification.

    `unkept` is a new result that could not be written there. It has no parameters to upload: any file there belongs
    to an earlier result, or lacks a matching result. A parameter file older than the result is not its own either, for
    an identification without values writes none.
    """
    at = results_beside(dive)
    result, param = at["--json"], at["--param"]
    try:
        accepted = _accepted(param, receipts)
        if unkept is not None:
            return _parsed(unkept, accepted, None, math.nan)
        of_result = param if newer(param, result) else None
        return _parsed(json_in(result), accepted, of_result, written_ns(result) * 1e-9)
    except (ValueError, KeyError, TypeError):
        return None


def _accepted(param: Path, receipts: Path) -> dict[str, float]:
    """Last accepted values by coefficient, for the vehicle and the configuration of the file `param`."""
    try:
        ids, accepted = read_parameters(param), accepted_of(param, receipts)
    except ParamError:
        return {}
    known = {name: coefficient_of(name) for name in ids if name in accepted}
    return {
        coefficient.name: accepted[name].value
        for name, coefficient in known.items()
        if coefficient is not None
    }


def _parsed(
    data: Mapping[str, Any], accepted: Mapping[str, float], param: Path | None, written_unix_s: float
) -> Identified:
    doubts = tuple(dict.fromkeys(str(doubt["sentence"]) for doubt in data["doubts"]))
    scale = data["thrust_scale"]
    sentences = [entry["sentence"] for entry in (*data["null_directions"], *([scale] if scale else []))]
    notes = dict.fromkeys((*sentences, *data["notes"]))
    second = data.get("comparison")
    return Identified(
        str(data["dive"]["name"]),
        str(data["configuration"]),
        str(data["method"]),
        str(data["outcome"]),
        tuple(_value(entry, accepted) for entry in data["parameters"]),
        doubts,
        tuple(str(note) for note in notes if note not in doubts),
        Comparison(str(second["method"]), str(second["outcome"]), tuple(map(str, second["sentences"])))
        if second
        else None,
        param,
        written_unix_s,
    )


def _value(data: Mapping[str, Any], accepted: Mapping[str, float]) -> Value:
    numbers = (data[key] for key in ("value", "low95", "high95", "given_thrust_low95", "given_thrust_high95"))
    value, low, high, *given = (
        math.nan if number is None or not data["identifiable"] else float(number) for number in numbers
    )
    name = str(data["name"])
    accepted_value = accepted.get(name, math.nan)
    return Value(
        name,
        str(data["unit"]),
        value,
        low,
        high,
        (given[0], given[1]),
        data.get("reason", ""),
        accepted_value,
    )
