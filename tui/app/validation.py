"""A validation as `seatrial validate --json` left it beside a dive, typed for the screen that shows it."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Final

import numpy as np

from gcs_plugin.watch.picture import Array

ROWS: Final = {
    "acceleration": "Acceleration",
    "steady_state": "Steady state",
    "deceleration": "Deceleration",
    "overall": "Overall",
}
EFFORTS: Final = {
    "delay_s": "delay, s",
    "pid_magnitude": "steady |PID|",
    "pid_minus_ff": "steady |PID - FF|",
}
CURVES: Final = ("reference", "measured", "tau_ff", "tau_pid")


@dataclass(frozen=True)
class Judged:
    """One thing that was looked at: as it must be, not so, or None where the dive does not show it."""

    what: str
    passed: bool | None
    words: str


@dataclass(frozen=True)
class Verdict:
    """Go or no-go for raising the feed-forward."""

    go: bool
    sentence: str
    judged: tuple[Judged, ...]


@dataclass(frozen=True)
class Curves:
    """One axis over the dive, (n,) each, SI; NaN where nothing is known."""

    axis: str
    unit: str
    wrench_unit: str
    time_s: Array
    reference: Array
    measured: Array
    tau_ff: Array
    tau_pid: Array


@dataclass(frozen=True)
class Run:
    """One dive. `errors` by axis, then by ROWS and EFFORTS; NaN for what does not occur."""

    label: str
    dive: str
    verdict: Verdict | None
    units: Mapping[str, str]
    errors: Mapping[str, Mapping[str, float]]
    curves: tuple[Curves, ...]


def runs(data: Any) -> tuple[Run, ...] | None:
    """The dives of a validation in the order of their modes; None where it is none."""
    try:
        return tuple(_run(one) for one in data) or None
    except (KeyError, TypeError, ValueError, AttributeError):
        return None


def _run(data: Mapping[str, Any]) -> Run:
    dive, label, told = str(data["dive"]), str(data["run"]), data.get("raising")
    verdict = None
    if told is not None:
        judged = tuple(Judged(str(one["what"]), one["passed"], str(one["words"])) for one in told["criteria"])
        verdict = Verdict(bool(told["go"]), str(told["sentence"]), judged)
    return Run(
        # Two dives of one mode are told apart by their names: here their hours are enough.
        _short(label, dive),
        dive,
        verdict,
        {one["axis"]: str(one["unit"]) for one in data["axes"]},
        {one["axis"]: {key: _number(one[key]) for key in (*ROWS, *EFFORTS)} for one in data["axes"]},
        tuple(_curves(one) for one in data.get("curves", ())),
    )


def _short(label: str, dive: str) -> str:
    rest = label.removeprefix(dive)
    hour = dive.partition("T")[2][:5]
    return f"{hour}{rest}" if rest != label and hour else label


def _curves(data: Mapping[str, Any]) -> Curves:
    values = [np.array([_number(value) for value in data[key]]) for key in CURVES]
    time_s = data["start_s"] + data["step_s"] * np.arange(len(values[0]))
    return Curves(str(data["axis"]), str(data["unit"]), str(data["wrench_unit"]), time_s, *values)


def _number(value: Any) -> float:
    """A number of a JSON file, where null stands for none."""
    return math.nan if value is None else float(value)
