"""Reasons to distrust identified values, and the outcome that they give an identification."""

from collections.abc import Collection, Iterable
from dataclasses import dataclass
from enum import Enum
from typing import Any

from bridge.text import as_clause
from bridge.vehicle.coefficients import DAMPINGS, MASSES


class Outcome(Enum):
    """How an identification ended; the value is the text that a user reads. Ordered from best to worst."""

    CONVERGED = "converged"
    AT_BOUND = "stopped at a bound"
    DISAGREES = "data and model disagree"
    NOT_IDENTIFIABLE = "not identifiable"


class Culprit(Enum):
    """The source of a doubt. An error of the MODEL repeats in the next dive of the same vehicle."""

    RECORDING = "recording"
    MODEL = "model"
    PRIOR = "prior"


@dataclass(frozen=True)
class Doubt:
    """A reason to distrust the values of the coefficients `about`: the problem, and its mend (`remedy`).

    `outcome` is the outcome that the doubt gives the identification; CONVERGED for a mere warning. A doubt about a
    PRIOR concerns no value that the dive itself gave. `also`: coefficients that lean on those doubted.
    """

    about: tuple[str, ...]
    problem: str
    remedy: str = ""
    outcome: Outcome = Outcome.CONVERGED
    culprit: Culprit = Culprit.RECORDING
    also: tuple[str, ...] = ()

    @property
    def sentence(self) -> str:
        return f"{self.problem}: {self.remedy}" if self.remedy else self.problem

    @property
    def clause(self) -> str:
        """The problem, for use inside another sentence."""
        return as_clause(self.problem)

    def to_json(self) -> dict[str, Any]:
        return {
            "about": list(self.about),
            "sentence": self.sentence,
            "problem": self.problem,
            "remedy": self.remedy,
            "outcome": self.outcome.value,
            "culprit": self.culprit.value,
            "also": list(self.also),
        }


def worst(outcomes: Iterable[Outcome]) -> Outcome:
    """The outcome that comes last in the list of outcomes; CONVERGED if there are none."""
    return max(outcomes, key=list(Outcome).index, default=Outcome.CONVERGED)


def coefficients_of(dofs: Collection[int]) -> tuple[str, ...]:
    """Names of the masses of these degrees of freedom, then of their linear dampings."""
    return tuple(group[dof].name for group in (MASSES, DAMPINGS) for dof in dofs)
