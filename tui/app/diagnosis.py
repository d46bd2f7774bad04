"""A diagnosis that `seatrial diagnose --json` left next to a dive, typed for its screen."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Final

from bridge.vehicle.coefficients import DOFS

PHASES: Final = {
    "rest": "at rest",
    "accelerating": "speeds up",
    "decelerating": "slows",
    "steady": "steady",
    "turning": "turns",
    "reversing": "reverses",
}
VERDICTS: Final = {
    "no_gap": "No gap: nothing but noise is between model and recording.",
    "explained": "The gap is explained.",
    "partly": "Part of the gap is explained, and something is left that no candidate explains.",
    "ambiguous": "A cause is one of several that this dive can't tell apart.",
    "unknown": "Something is there that no candidate explains.",
}


@dataclass(frozen=True)
class Cause:
    """A cause in words, accepted or possible; `gain_nats` is NaN if the file lacks it."""

    name: str
    probability: float
    gain_nats: float
    sentence: str
    alike: str
    values: tuple[str, ...]


@dataclass(frozen=True)
class Tried:
    """A candidate that was not accepted; `why` explains the rejection of one with enough gain, "" for none."""

    name: str
    gain_nats: float
    why: str


@dataclass(frozen=True)
class AxisFall:
    """Drift over 5 s of a degree of freedom, m/s or rad/s, and the RMS error of its simulated velocity relative to
    the spread of the measured velocity; NaN if unknown.
    """

    dof: str
    before: float
    after: float
    floor: float
    nrmse_before: float
    nrmse_after: float
    nrmse_baseline: float


@dataclass(frozen=True)
class Fall:
    """Drift before and after in multiples of the noise floor, on the data named by `what`; `value` is the fraction of
    the closable gap that was closed. NaN if unknown. `axes`: the same by degree of freedom.
    """

    what: str
    before: float
    after: float
    floor: float
    value: float
    low95: float = math.nan
    high95: float = math.nan
    axes: tuple[AxisFall, ...] = ()


@dataclass(frozen=True)
class Answer:
    """`shares` of the squared gap by degree of freedom and phase; `force_n` is the missing force, N or N m;
    `disturbance` describes the disturbance in words.
    """

    dive: str
    check: str
    verdict: str
    sentence: str
    shares: Mapping[tuple[str, str], float]
    force_n: Mapping[str, float]
    causes: tuple[Cause, ...]
    tried: tuple[Tried, ...]
    falls: tuple[Fall, ...]
    disturbance: tuple[str, ...]
    character: tuple[str, ...]
    next: tuple[str, ...]
    notes: tuple[str, ...]


def answer(data: Any) -> Answer | None:
    """Parse a diagnosis from a JSON value; None if it is not a diagnosis."""
    try:
        return _answer(data)
    except (KeyError, TypeError, ValueError, AttributeError):
        return None


def _answer(data: Mapping[str, Any]) -> Answer:
    gap, wording = data["gap"], data.get("told") or {}
    words = wording.get("causes") or [{}] * len(data["effects"])
    more = data["next"] or {}
    dives = [more.get("manoeuvre"), more.get("sensor")]
    return Answer(
        dive=str(wording.get("dive", "")),
        check=str(wording.get("check", "")),
        verdict=str(data["verdict"]),
        sentence=str(wording.get("verdict") or VERDICTS[data["verdict"]]),
        shares={(str(entry["dof"]), str(entry["phase"])): float(entry["share"]) for entry in gap["where"]},
        force_n={dof: _number(force) for dof, force in (gap.get("force") or {}).items() if dof in DOFS},
        causes=tuple(_cause(*both) for both in zip(data["effects"], words, strict=True)),
        tried=tuple(
            Tried(str(entry["name"]), float(entry["gain_nats"]), str(entry["why"]))
            for entry in wording.get("tried", ())
        ),
        falls=tuple(_falls(gap, data["shrink"], wording)),
        disturbance=tuple(map(str, wording.get("disturbance", ()))),
        character=tuple(map(str, wording.get("character", ()))),
        next=tuple(map(str, wording.get("next") or filter(None, dives))),
        notes=tuple(map(str, wording.get("notes", ()))),
    )


def _cause(effect: Mapping[str, Any], words: Mapping[str, Any]) -> Cause:
    plain = str(effect["name"]).replace("_", " ")
    values = [f"{name} {_interval(entry)}" for name, entry in effect["parameters"].items()]
    alike = ", ".join(str(entry).replace("_", " ") for entry in effect["also"])
    return Cause(
        str(words.get("name", plain)),
        float(effect["probability"]),
        _number(words.get("gain_nats")),
        str(words.get("sentence", "")),
        str(words.get("alike") or (f"This dive can't tell it from {alike}." if alike else "")),
        tuple(map(str, words.get("values", values))),
    )


def _falls(gap: Mapping[str, Any], shrink: Mapping[str, Any], told: Mapping[str, Any]) -> list[Fall]:
    """Shrinkage on the dive itself, on held-out pieces, and on the check dive."""
    held, sides = shrink["heldout"], told.get("heldout") or {}
    falls = [Fall("this dive", _number(gap["before"]), _number(told.get("after")), 1.0, math.nan)]
    if held is not None:
        ends = (_number(sides.get("before")), _number(sides.get("after")), 1.0)
        value, low95, high95 = (_number(held.get(key)) for key in ("value", "low95", "high95"))
        falls.append(Fall("pieces held out", *ends, value, low95, high95, _axes(sides)))
    check = shrink["check"]
    if check is not None:
        name = told.get("check")
        name_of_data = f"check dive {name}" if name else "check dive"
        before, after, floor, value = (
            _number(check.get(key)) for key in ("before", "after", "floor", "value")
        )
        falls.append(Fall(name_of_data, before, after, floor, value, axes=_axes(check)))
    return falls


def _axes(data: Mapping[str, Any]) -> tuple[AxisFall, ...]:
    keys = ("before", "after", "floor", "nrmse_before", "nrmse_after", "nrmse_baseline")
    per_axis = data.get("by_axis") or {}
    return tuple(
        AxisFall(dof, *(_number(per_axis[dof].get(key)) for key in keys)) for dof in DOFS if dof in per_axis
    )


def _interval(value: Mapping[str, Any]) -> str:
    ends = value["low95"], value["high95"]
    interval = "" if None in ends else f" (95 %: {ends[0]:.3g} to {ends[1]:.3g})"
    return f"{value['value']:.3g} {value['unit']}{interval}"


def _number(value: Any) -> float:
    """A number of a JSON file, NaN for null."""
    return math.nan if value is None else float(value)
