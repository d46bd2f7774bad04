"""A validation as `seatrial validate --json` left it beside a dive, typed for the screen that shows it."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Final

from identify.glance.followed import Followed

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
class Run:
    """One dive. `errors` by axis, then by ROWS and EFFORTS; NaN for what does not occur."""

    label: str
    dive: str
    verdict: Verdict | None
    units: Mapping[str, str]
    errors: Mapping[str, Mapping[str, float]]
    curves: tuple[Followed, ...]


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
        judged = tuple(
            Judged(str(one["what"]), _passed(one["passed"]), str(one["words"])) for one in told["criteria"]
        )
        verdict = Verdict(bool(told["go"]), str(told["sentence"]), judged)
    return Run(
        # Two dives of one mode are told apart by their names: here their hours are enough.
        _short(label, dive),
        dive,
        verdict,
        {one["axis"]: str(one["unit"]) for one in data["axes"]},
        {one["axis"]: {key: _number(one[key]) for key in (*ROWS, *EFFORTS)} for one in data["axes"]},
        tuple(Followed.from_json(one) for one in data.get("curves", ())),
    )


def _short(label: str, dive: str) -> str:
    rest = label.removeprefix(dive)
    hour = dive.partition("T")[2][:5]
    return f"{hour}{rest}" if rest != label and hour else label


def _passed(value: Any) -> bool | None:
    if value is None or isinstance(value, bool):
        return value
    raise ValueError("neither passed nor failed")


def _number(value: Any) -> float:
    """A number of a JSON file, where null stands for none."""
    return math.nan if value is None else float(value)
