"""Answers held beside what was hidden in field dives, by the goals' own rules."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

from bench.field.draw import NONE
from bench.remembered import Data
from identify.challenge.answers import Named, errors
from identify.challenge.score import Rate

LIKELY = 0.5
HULL = "quadratic_drag"
"""Every small ROV's: named, it is neither right nor wrong."""

NAMING = ("explained", "partly")
PLACES = ("thruster",)


@dataclass(frozen=True)
class Judged:
    """One dive: its truth, the answer in the schema's form (None where it was refused), and what it took."""

    truth: Mapping[str, Any]
    answer: Mapping[str, Any] | None
    refusal: str
    seconds: float
    drifts: Mapping[str, Any]

    @property
    def effect(self) -> str:
        return str(self.truth["effect"][0])

    @property
    def empty(self) -> bool:
        return self.effect == NONE

    @property
    def size(self) -> float:
        return float(self.truth["size_over_sea"])

    @property
    def verdict(self) -> str:
        return "refused" if self.answer is None else str(self.answer["verdict"])

    @cached_property
    def named(self) -> tuple[Named, ...]:
        """All causes but the hull's own drag, strongest first."""
        told = [] if self.answer is None else self.answer["effects"]
        return tuple(_named(one) for one in told if one["name"] != HULL)

    @property
    def accepted(self) -> tuple[Named, ...]:
        return tuple(one for one in self.named if one.probability >= LIKELY)

    def right(self) -> Named | None:
        """What names the hidden cause by its own name: the first of all causes, or an accepted one."""
        if self.empty or self.verdict not in (*NAMING, "ambiguous"):
            return None
        able = self.accepted if self.verdict == "ambiguous" else (*self.named[:1], *self.accepted)
        return next((one for one in able if self._is(one)), None)

    def by_name(self) -> bool:
        return self.right() is not None

    def by_also(self) -> bool:
        """Whether it is only among those that an accepted cause could not be told from."""
        if self.empty or self.by_name() or self.verdict not in (*NAMING, "ambiguous"):
            return False
        return any(self.effect in one.also for one in self.accepted)

    def false(self) -> tuple[Named, ...]:
        """Accepted causes that are not there, nor could not be told from what is."""
        return tuple(one for one in self.accepted if not self._is(one) and self.effect not in one.also)

    def errors(self) -> dict[str, float]:
        """Of each parameter of the right cause: how far off, over how large it truly is."""
        right = self.right()
        return {} if right is None else errors(dict(self.truth["effect_parameters"]), right)

    def delay_off_s(self) -> float | None:
        """How far off the delay is, of a delay that was named."""
        right = self.right()
        if right is None or self.effect != "command_delay" or "delay" not in right.parameters:
            return None
        return abs(right.parameters["delay"][0] - float(self.truth["effect_parameters"]["delay"]))

    def _is(self, one: Named) -> bool:
        """By name, and by the thruster's number where it is told."""
        if one.name != self.effect:
            return False
        told, true = one.parameters.get("thruster"), self.truth["effect_parameters"].get("thruster")
        return told is None or true is None or round(told[0]) == round(true)


def judged(data: Data) -> Judged:
    return Judged(data["truth"], data["answer"], data["refusal"], float(data["seconds"]), data["drifts"])


def _named(effect: Mapping[str, Any]) -> Named:
    parameters = {
        name: (_number(p["value"]), _number(p.get("low95")), _number(p.get("high95")))
        for name, p in effect["parameters"].items()
    }
    return Named(effect["name"], tuple(effect["also"]), _number(effect["probability"]), parameters)


def _number(value: Any) -> float:
    return math.nan if value is None else float(value)


def rate_named(cases: Sequence[Judged]) -> Rate:
    """Of dives that hide something: those named by their own name."""
    hidden = [one for one in cases if not one.empty]
    return Rate(sum(one.by_name() for one in hidden), len(hidden))


def rate_also(cases: Sequence[Judged]) -> Rate:
    hidden = [one for one in cases if not one.empty]
    return Rate(sum(one.by_also() for one in hidden), len(hidden))


def false_causes(cases: Sequence[Judged]) -> int:
    return sum(len(one.false()) for one in cases)


def magnitudes(cases: Sequence[Judged]) -> list[float]:
    """The errors of all parameters of right causes."""
    return [error for one in cases for error in one.errors().values() if math.isfinite(error)]


def delays_s(cases: Sequence[Judged]) -> list[float]:
    return [off for one in cases if (off := one.delay_off_s()) is not None]
