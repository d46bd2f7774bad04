"""A diagnosis as `seatrial diagnose` left it beside its dive."""

from collections.abc import Mapping
from dataclasses import dataclass, fields
from functools import lru_cache
from pathlib import Path
from typing import Any, Final

from bridge.errors import ConfigError
from bridge.files import written_ns
from bridge.schema import build
from bridge.vehicle.coefficients import DOFS
from bridge.vehicle.forecast import ForecastRow
from identify.diagnose.shrink.shrunk import CHANCE, LIKELY, AxisShrink, Shrink
from identify.validation.against_forecast import rows_words
from tui.app.jobs import json_in, real

PHASES: Final = {
    "rest": "at rest",
    "accelerating": "speeds up",
    "decelerating": "slows",
    "steady": "steady",
    "turning": "turns",
    "reversing": "reverses",
}
"""The phases of motion of a diagnosis, in words."""
FITTED: Final = "this dive, which was fitted"
OF_DRIFT: Final = ("after", "heldout", "by_axis")
"""Drifts in numbers."""


@dataclass(frozen=True)
class Cause:
    """The words of a cause, accepted or possible; changed: it is the change of one that was accepted before."""

    name: str
    gain_nats: float
    sentence: str
    alike: str
    values: tuple[str, ...]
    changed: bool = False


@dataclass(frozen=True)
class Tried:
    """A candidate that was not accepted; `why` explains the rejection of one with enough gain, "" for none."""

    name: str
    gain_nats: float
    why: str


@dataclass(frozen=True)
class Words:
    """A diagnosis in sentences, with the causes in the order of its effects."""

    dive: str
    check: str
    configuration: str
    verdict: str
    causes: tuple[Cause, ...]
    tried: tuple[Tried, ...]
    character: tuple[str, ...]
    next: tuple[str, ...]
    notes: tuple[str, ...]
    disturbance: tuple[str, ...] = ()


@dataclass(frozen=True)
class Answer:
    """A diagnosis as the screen shows it.

    `shares` of the squared gap by degree of freedom and phase; `force_n` is the missing force, N or N m;
    `probabilities` of the causes; `shrinks` of the drift by the data that it was measured on, the severest test first,
    NaN if unknown.
    """

    verdict: str
    shares: Mapping[tuple[str, str], float]
    force_n: Mapping[str, float]
    probabilities: tuple[float, ...]
    shrinks: Mapping[str, Shrink]
    words: Words

    @property
    def contradicted(self) -> bool:
        """Whether the model drifts further with the causes: its notes then say to send nothing of them."""
        return any(shrink.after > shrink.before for shrink in self.shrinks.values())

    @property
    def drifts(self) -> bool:
        """Whether the model drifts further than noise drives it, whatever the verdict."""
        return self.shrinks[FITTED].before > 1.0 + CHANCE

    @property
    def changed(self) -> bool:
        """Whether something that was accepted before has likely changed."""
        causes = zip(self.words.causes, self.probabilities, strict=True)
        return any(cause.changed and probability >= LIKELY for cause, probability in causes)


@dataclass(frozen=True)
class Foretold:
    """How the next dive will track, in sentences; `why` those on what can't be foretold."""

    words: tuple[str, ...] = ()
    why: tuple[str, ...] = ()


def answer(data: Any) -> Answer | None:
    """Parse a diagnosis from a DIAGNOSED value; None if it is not a diagnosis."""
    try:
        return _answer(data)
    except (KeyError, TypeError, ValueError, AttributeError, ConfigError):
        return None


def foretold(data: Any) -> Foretold | None:
    """The prediction for the next dive from a sidecar's value; None if it is no sidecar."""
    try:
        rows = [build(ForecastRow, row, "foretold") for row in data.get("foretold", ())]
        return Foretold(rows_words(rows), tuple(map(str, data.get("unforetold", ()))))
    except (TypeError, ValueError, AttributeError, ConfigError):
        return None


def _answer(data: Mapping[str, Any]) -> Answer:
    gap, worded = data["gap"], data["told"]
    words = build(Words, {key: worded[key] for key in worded if key not in OF_DRIFT}, "told")
    of_dive = {"before": gap["before"], "after": worded["after"], "by_axis": worded.get("by_axis", {})}
    shrinks = {}
    if data["shrink"]["check"] is not None:
        shrinks[f"check dive {words.check}"] = _shrink(data["shrink"]["check"])
    if data["shrink"]["heldout"] is not None:
        shrinks["pieces held out"] = _shrink(data["shrink"]["heldout"] | worded["heldout"])
    shrinks[FITTED] = _shrink(of_dive)
    probabilities = tuple(float(effect["probability"]) for effect in data["effects"])
    if len(probabilities) != len(words.causes):
        raise ValueError("causes without words")
    if any(entry["phase"] not in PHASES for entry in gap["where"]):
        raise ValueError("a phase that is none")
    return Answer(
        verdict=str(data["verdict"]),
        shares={(str(entry["dof"]), str(entry["phase"])): float(entry["share"]) for entry in gap["where"]},
        force_n={dof: real(force) for dof, force in gap["force"].items() if dof in DOFS},
        probabilities=probabilities,
        shrinks=shrinks,
        words=words,
    )


def _shrink(data: Mapping[str, Any]) -> Shrink:
    by_axis = data.get("by_axis", {})
    of_axis = [field.name for field in fields(AxisShrink) if field.name != "dof"]
    return Shrink(
        **{name: real(data.get(name)) for name in ("before", "after", "value", "low95", "high95")},
        floor=real(data.get("floor", 1.0)),
        by_axis=tuple(
            AxisShrink(dof, **{name: real(by_axis[dof].get(name)) for name in of_axis})
            for dof in DOFS
            if dof in by_axis
        ),
    )


def answer_in(file: Path) -> Answer | None:
    """The diagnosis that a file holds, read once for each change of it; None without one."""
    return _read(file, written_ns(file))


def is_contradicted(file: Path) -> bool:
    """Whether the diagnosis that a file holds is contradicted by the data that it was checked on; False without one."""
    read = answer_in(file)
    return read is not None and read.contradicted


@lru_cache(64)
def _read(file: Path, _changed_ns: int) -> Answer | None:
    return answer(json_in(file))
