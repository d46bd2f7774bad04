"""Answers judged against the effects hidden in field dives, by the goals' own rules."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

from bench.field.draw import NONE
from bench.remembered import Data
from identify.challenge.answer import Named, errors, named_in
from identify.challenge.score import Rate

LIKELY = 0.5
HULL = "quadratic_drag"
"""Every small ROV has it, so naming it is neither right nor wrong."""

NAMING = ("explained", "partly")


@dataclass(frozen=True)
class Judged:
    """A dive: its truth, the answer in the schema's form (None if refused), the reason of a refusal, seconds,
    drifts."""

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
        effects = [] if self.answer is None else self.answer["effects"]
        return tuple(named_in(effect) for effect in effects if effect["name"] != HULL)

    @property
    def accepted(self) -> tuple[Named, ...]:
        return tuple(cause for cause in self.named if cause.probability >= LIKELY)

    def right(self) -> Named | None:
        """The cause that names the hidden effect: the first of all causes, or an accepted one; None if nothing does.

        If the verdict is ambiguous, only accepted causes count.
        """
        if self.empty or self.verdict not in (*NAMING, "ambiguous"):
            return None
        candidates = self.accepted if self.verdict == "ambiguous" else (*self.named[:1], *self.accepted)
        return next((cause for cause in candidates if self._is(cause)), None)

    def by_name(self) -> bool:
        return self.right() is not None

    def by_also(self) -> bool:
        """Whether the effect appears only among the alternatives (`also`) of an accepted cause."""
        if self.empty or self.by_name() or self.verdict not in (*NAMING, "ambiguous"):
            return False
        return any(self.effect in cause.also for cause in self.accepted)

    def false(self) -> tuple[Named, ...]:
        """Accepted causes that are not present, and whose alternatives do not include the hidden effect."""
        return tuple(
            named for named in self.accepted if not self._is(named) and self.effect not in named.also
        )

    def errors(self) -> dict[str, float]:
        """Error of each parameter of the right cause, relative to its true size."""
        right = self.right()
        return {} if right is None else errors(dict(self.truth["effect_parameters"]), right)

    def delay_off_s(self) -> float | None:
        """Error of the delay, s, if a delay was hidden and named; otherwise None."""
        right = self.right()
        if right is None or self.effect != "command_delay" or "delay" not in right.parameters:
            return None
        return abs(right.parameters["delay"][0] - float(self.truth["effect_parameters"]["delay"]))

    def _is(self, named: Named) -> bool:
        """Whether a cause matches the hidden effect by name and, if both give one, by thruster number."""
        if named.name != self.effect:
            return False
        true = self.truth["effect_parameters"].get("thruster")
        return true is None or named.may_be_of(true)


def judged(data: Data) -> Judged:
    return Judged(data["truth"], data["answer"], data["refusal"], float(data["seconds"]), data["drifts"])


def rate_named(cases: Sequence[Judged]) -> Rate:
    """Of the dives that hide an effect, those in which it was named by its own name."""
    hidden = [case for case in cases if not case.empty]
    return Rate(sum(case.by_name() for case in hidden), len(hidden))


def rate_also(cases: Sequence[Judged]) -> Rate:
    hidden = [case for case in cases if not case.empty]
    return Rate(sum(case.by_also() for case in hidden), len(hidden))


def false_causes(cases: Sequence[Judged]) -> int:
    return sum(len(case.false()) for case in cases)


def magnitudes(cases: Sequence[Judged]) -> list[float]:
    return [error for case in cases for error in case.errors().values() if math.isfinite(error)]


def delays_s(cases: Sequence[Judged]) -> list[float]:
    return [off for case in cases if (off := case.delay_off_s()) is not None]
