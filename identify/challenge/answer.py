"""The answer of a diagnosis as far as it is scored, read from its JSON, and the errors of its magnitudes."""

import json
import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from bridge.errors import LogError
from identify.challenge.vehicles import LAG_S

VERDICTS = ("no_gap", "explained", "partly", "ambiguous", "unknown")


@dataclass(frozen=True)
class Named:
    """A cause in an answer. parameters: value and 95 % interval (NaN if missing)."""

    name: str
    also: tuple[str, ...]
    probability: float
    parameters: dict[str, tuple[float, float, float]]

    def may_be_of(self, thruster: float) -> bool:
        """Whether it names that thruster, counted from 1, or none."""
        number = self.parameters.get("thruster", (math.nan,))[0]
        return math.isnan(number) or abs(number - thruster) < 0.5


@dataclass(frozen=True)
class Answer:
    """A diagnosis as far as it is scored.

    dofs: shares of the gap by degree of freedom. predicted, measured: shrink of the gap on held-out legs and on
    the check dive. before, after: drifts on the check dive, in noise floors. NaN if missing.
    """

    verdict: str
    named: tuple[Named, ...]
    dofs: dict[str, float]
    predicted: float
    measured: float
    before: float = math.nan
    after: float = math.nan

    @property
    def first_dof(self) -> str | None:
        return max(self.dofs, key=lambda dof: self.dofs[dof]) if self.dofs else None


def read_answer(path: Path) -> Answer | None:
    """Read the answer from a file; None if the file does not exist. Raises LogError if it holds no valid answer."""
    try:
        text = path.read_text(encoding="utf-8")
    except FileNotFoundError:
        return None
    except (OSError, UnicodeDecodeError):
        raise LogError(f"{path}: can't be read; give the JSON that diagnose wrote") from None
    try:
        return answer_of(json.loads(text))
    except (ValueError, KeyError, TypeError, AttributeError, OverflowError) as error:
        raise LogError(f"{path}: is no answer of diagnose ({error}); give the JSON that it wrote") from None


def answer_of(data: dict[str, Any]) -> Answer:
    """Parse an answer in the schema's form; ValueError, KeyError, TypeError, AttributeError or OverflowError if it is
    invalid."""
    if data["verdict"] not in VERDICTS:
        raise ValueError(f"the verdict is '{data['verdict']}'")
    dofs: dict[str, float] = {}
    for place in data["gap"]["where"]:
        dofs[place["dof"]] = dofs.get(place["dof"], 0.0) + _number(place["share"])
    shrink = data["shrink"]
    check = shrink["check"] or {}
    return Answer(
        data["verdict"],
        tuple(named_in(effect) for effect in data["effects"]),
        dofs,
        _number((shrink["heldout"] or {}).get("value")),
        _number(check.get("value")),
        _number(check.get("before")),
        _number(check.get("after")),
    )


def named_in(effect: Mapping[str, Any]) -> Named:
    """A cause that an answer names, of its JSON; the errors of `answer_of` if it is invalid."""
    parameters = {
        name: (_number(p["value"]), _number(p.get("low95")), _number(p.get("high95")))
        for name, p in effect["parameters"].items()
    }
    name, *also = names = (effect["name"], *effect["also"])
    if not all(isinstance(each, str) for each in names):
        raise TypeError("a cause's name is no text")
    probability = _number(effect["probability"])
    if probability < 0.0 or probability > 1.0:
        raise ValueError(f"the probability of {name} is {probability:g}")
    return Named(name, tuple(also), probability, parameters)


def _number(value: Any) -> float:
    return math.nan if value is None else float(value)


ABSENT_AT = {"gain": 1.0, "scale": 1.0, "ratio": 1.0, "time_constant": LAG_S}
"""Parameter values at which an effect is absent, if not zero."""

VECTORS = ("x", "y", "z", "north", "east", "X", "Y", "Z", "roll", "pitch")
"""Components of a vector: the error of each is divided by the length of the vector."""

UNMEASURED = ("thruster", "period")


def errors(truth: dict[str, float], named: Named) -> dict[str, float]:
    """Relative error of each parameter that both the truth and the answer give."""
    length = math.hypot(*(truth[name] for name in VECTORS if name in truth))
    out = {}
    for name, true in truth.items():
        scale = length if name in VECTORS else abs(true - ABSENT_AT.get(name, 0.0))
        if name in named.parameters and name not in UNMEASURED and scale > 0:
            out[name] = abs(named.parameters[name][0] - true) / scale
    return out
