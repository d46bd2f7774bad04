"""A validation that `seatrial validate --json` left next to a dive, typed for its screen."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Final

from identify.glance.following import Followed

ROWS: Final = {
    "acceleration": "Acceleration",
    "steady_state": "Steady state",
    "deceleration": "Deceleration",
    "overall": "Overall",
}
EFFORTS: Final = {
    "delay_s": "delay, ms",
    "pid_magnitude": "steady |PID|",
    "pid_minus_ff": "steady |PID - FF|",
}


@dataclass(frozen=True)
class Judged:
    """One criterion: passed, failed, or None if the dive does not show it."""

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
class Run:
    """One dive. `errors` by axis, then by ROWS and EFFORTS; NaN if the phase does not occur."""

    label: str
    dive: str
    verdict: Verdict | None
    units: Mapping[str, str]
    errors: Mapping[str, Mapping[str, float]]
    curves: tuple[Followed, ...]


def runs(data: Any) -> tuple[Run, ...] | None:
    """Parse a validation into its dives in the order of their modes; None if it is not a validation."""
    try:
        return tuple(_run(entry) for entry in data) or None
    except (KeyError, TypeError, ValueError, AttributeError):
        return None


def _run(data: Mapping[str, Any]) -> Run:
    dive, label, raising = str(data["dive"]), str(data["run"]), data.get("raising")
    verdict = None
    if raising is not None:
        judged = tuple(
            Judged(str(entry["what"]), _passed(entry["passed"]), str(entry["words"]))
            for entry in raising["criteria"]
        )
        verdict = Verdict(bool(raising["go"]), str(raising["sentence"]), judged)
    return Run(
        # Two dives of one mode are distinguished by their names; here their hours suffice.
        _short(label, dive),
        dive,
        verdict,
        {entry["axis"]: str(entry["unit"]) for entry in data["axes"]},
        {entry["axis"]: {key: _number(entry[key]) for key in (*ROWS, *EFFORTS)} for entry in data["axes"]},
        tuple(Followed.from_json(entry) for entry in data.get("curves", ())),
    )


def _short(label: str, dive: str) -> str:
    suffix = label.removeprefix(dive)
    hour = dive.partition("T")[2][:5]
    return f"{hour}{suffix}" if suffix != label and hour else label


def _passed(value: Any) -> bool | None:
    if value is None or isinstance(value, bool):
        return value
    raise ValueError("neither passed nor failed")


def _number(value: Any) -> float:
    """A number of a JSON file, NaN for null."""
    return math.nan if value is None else float(value)
