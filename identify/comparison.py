"""Two methods on one dive: where they disagree beyond their intervals, and why.

Both saw the same noise, so their difference spreads less than the root of the sum of their variances. For an efficient
estimator and another of the same truth its variance is the difference of theirs (Hausman 1978, lemma 2.1), at most the
larger of the two: `TOO_FAR` of the larger standard error is hardly chance, whichever of them is efficient.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from bridge.vehicle.coefficients import BY_NAME, DOFS
from identify.identification import Doubt, Estimate, Identification, Outcome

TOO_FAR = 2.5
"""At the very worst, one in seven dives has one of a dozen coefficients beyond it by chance."""

OTHER_SEA = 1.5
"""Two fitted disturbances differ where one is this many times the other."""


@dataclass(frozen=True)
class Difference:
    """One coefficient by both methods. `distance`: second less first, in standard errors of the less sure of the two.

    NaN where one of them has no value. `why` is a sentence where they disagree, empty elsewhere.
    """

    name: str
    first: Estimate
    second: Estimate
    distance: float
    why: str = ""

    @property
    def disagrees(self) -> bool:
        return abs(self.distance) > TOO_FAR


@dataclass(frozen=True)
class Comparison:
    """What a second method says of the same dive, beside the first."""

    first: Identification
    second: Identification
    differences: tuple[Difference, ...]

    @property
    def disagreements(self) -> tuple[Difference, ...]:
        return tuple(d for d in self.differences if d.disagrees)

    @property
    def sentences(self) -> tuple[str, ...]:
        """One for each disagreement; where there is none, one that says so."""
        if told := tuple(d.why for d in self.disagreements):
            return told
        both = [d for d in self.differences if math.isfinite(d.distance)]
        names = f"{self.first.method} and {self.second.method}"
        if not both:
            return (f"No parameter has an interval by both {names}: there is nothing to compare.",)
        furthest = max(both, key=lambda d: abs(d.distance))
        return (
            f"{names[0].upper()}{names[1:]} agree in all {len(both)} parameters that both identify: at most "
            f"{abs(furthest.distance):.2g} standard errors apart, in {furthest.name}.",
        )

    def to_json(self) -> dict[str, Any]:
        """The entry `comparison` of the first method's JSON."""
        return {
            "method": self.second.method,
            "outcome": self.second.outcome.value,
            "wall_s": self.second.wall_s,
            "parameters": [
                {**d.second.to_json(), "difference_in_std": _number(d.distance), "disagrees": d.disagrees}
                | ({"why": d.why} if d.why else {})
                for d in self.differences
            ],
            "doubts": [doubt.to_json() for doubt in self.second.doubts],
            "notes": list(self.second.notes),
            "sentences": list(self.sentences),
        }


def compare(first: Identification, second: Identification) -> Comparison:
    """The coefficients of both, in the order of the first."""
    by_name = {one.name: one for one in second.parameters}
    differences = [
        _difference(one, by_name[one.name], first, second)
        for one in first.parameters
        if one.name in by_name and one.name in BY_NAME
    ]
    return Comparison(first, second, tuple(differences))


def _difference(one: Estimate, other: Estimate, first: Identification, second: Identification) -> Difference:
    distance = distance_between(one, other)
    if not abs(distance) > TOO_FAR:
        return Difference(one.name, one, other, distance)
    percent = 100 * (other.value / one.value - 1)
    apart = (
        f"{one.name}: {second.method} says {other.value:.4g} {one.unit}, {first.method} {one.value:.4g}, "
        f"{percent:+.1f} % and {abs(distance):.1f} standard errors apart"
    )
    return Difference(one.name, one, other, distance, f"{apart}: {_why(one.name, first, second)}")


def distance_between(one: Estimate, other: Estimate) -> float:
    """Other less one in standard errors of the less sure, of logarithms; NaN where either has none."""
    usable = one.identifiable and other.identifiable and one.value > 0 and other.value > 0
    stds = (one.relative_std, other.relative_std) if usable else (math.nan, math.nan)
    return math.log(other.value / one.value) / max(stds) if all(std > 0 for std in stds) else math.nan


def _why(name: str, first: Identification, second: Identification) -> str:
    """What either method doubts about the coefficient, or what they took differently."""
    reasons = []
    for method in (first, second):
        about = _doubts_about(name, method.doubts)
        if about:
            reasons.append(f"{method.method} doubts it itself ({'; '.join(about)})")
        elif method.outcome is not Outcome.CONVERGED:
            reasons.append(f"{method.method} ended with '{method.outcome.value}'")
    reasons += _other_disturbance(DOFS[BY_NAME[name].dof], first, second)
    if reasons:
        return f"{'; '.join(reasons)}."
    return (
        "neither doubts it, so one of them leaves out what the other has: trust neither until another dive, or the "
        "innovations in the report, tell which."
    )


def _doubts_about(name: str, doubts: Sequence[Doubt]) -> list[str]:
    return [doubt.clause for doubt in doubts if name in doubt.about]


def _other_disturbance(axis: str, first: Identification, second: Identification) -> list[str]:
    """How differently the two took the sea to push in an axis, where both say it."""
    key = f"{axis}_disturbance_std_{'n' if DOFS.index(axis) < 3 else 'nm'}"
    if key not in first.nuisance or key not in second.nuisance:
        return []
    one, other = first.nuisance[key], second.nuisance[key]
    if min(one, other) * OTHER_SEA > max(one, other):
        return []
    unit = "N" if DOFS.index(axis) < 3 else "N m"
    taken = f"{first.method} {one:.2g} {unit}, {second.method} {other:.2g} {unit}"
    return [f"they take the disturbance in {axis} differently ({taken})"]


def _number(value: float) -> float | None:
    return value if math.isfinite(value) else None
