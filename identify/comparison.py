"""Two methods on one dive: where they disagree beyond their intervals, and why.

They disagree on a coefficient where each one's value lies outside the other's 95 % interval, by as much as matters.
Both saw the same noise, so their difference spreads less than the root of the sum of their variances. For an efficient
estimator and another of the same truth its variance is the difference of theirs (Hausman 1978, lemma 2.1), at most the
larger of the two: what lies beyond both intervals is no chance, whichever of them is efficient.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any, Protocol

from bridge.vehicle.coefficients import DOFS, OF_HULL
from bridge.vehicle.config import Prior
from identify.identification import Doubt, Estimate, Identification, Outcome, Partner, worst
from identify.nuisance import WRITTEN, Quantity

LEAST_DIFFERENCE = 0.005
"""As a share of the value. A smaller one changes nothing that anybody does with it: the thrust that all values hang on
is known to some per cent, and a controller's feed-forward does not feel it."""

OTHER_LEVEL = 1.5
"""Two fitted noise levels differ where one is this many times the other."""

LEVELS = {
    Quantity.DISTURBANCE: "disturbance",
    Quantity.TIME_CONSTANT: "disturbance time constant",
    Quantity.NOISE: "noise",
}


class Interval(Protocol):
    """A value with its 95 % interval."""

    @property
    def value(self) -> float: ...
    @property
    def low95(self) -> float: ...
    @property
    def high95(self) -> float: ...


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
        return bool(self.why)


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
            f"{abs(furthest.distance):.2g} standard errors apart, in {furthest.name} ({_percent(furthest):+.2g} %).",
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


def compare(
    first: Identification, second: Identification, priors: Mapping[str, Prior] | None = None
) -> Comparison:
    """The coefficients of both, in the order of the first; `priors` of the vehicle file help to say who is right."""
    by_name = {one.name: one for one in second.parameters}
    differences = [
        _difference(one, by_name[one.name], first, second, (priors or {}).get(one.name))
        for one in first.parameters
        if one.name in by_name and one.name in OF_HULL
    ]
    return Comparison(first, second, tuple(differences))


def doubted(compared: Comparison) -> Identification:
    """The first method's answer, with a doubt about each coefficient of which the second says something else."""
    told = tuple(Doubt((d.name,), d.why, Outcome.DISAGREES) for d in compared.disagreements)
    if not told:
        return compared.first
    outcome = worst((compared.first.outcome, Outcome.DISAGREES))
    return replace(compared.first, outcome=outcome, doubts=(*compared.first.doubts, *told))


def _difference(
    one: Estimate, other: Estimate, first: Identification, second: Identification, prior: Prior | None
) -> Difference:
    distance = distance_between(one, other)
    if not (math.isfinite(distance) and apart(one, other)):
        return Difference(one.name, one, other, distance)
    why = (
        f"On {one.name} two methods disagree, {first.method} {one.value:.4g} ± {one.std:.2g} {one.unit} and "
        f"{second.method} {other.value:.4g} ± {other.std:.2g}, {100 * (other.value / one.value - 1):+.1f} % and "
        f"{abs(distance):.1f} standard errors apart: {_why(one, other, first, second, prior)}; rely on neither value "
        "before another dive tells (`seatrial plan --after` proposes one)."
    )
    return Difference(one.name, one, other, distance, why)


def apart(one: Interval, other: Interval) -> bool:
    """Whether each value lies outside the other's 95 % interval, and LEAST_DIFFERENCE of it or more away."""
    outside = all(not a.low95 <= b.value <= a.high95 for a, b in ((one, other), (other, one)))
    return outside and abs(other.value / one.value - 1) >= LEAST_DIFFERENCE


def distance_between(one: Estimate, other: Estimate) -> float:
    """Other less one in standard errors of the less sure, of logarithms; NaN where either has none."""
    usable = one.identifiable and other.identifiable and one.value > 0 and other.value > 0
    stds = (one.relative_std, other.relative_std) if usable else (math.nan, math.nan)
    return math.log(other.value / one.value) / max(stds) if all(std > 0 for std in stds) else math.nan


def _why(
    one: Estimate, other: Estimate, first: Identification, second: Identification, prior: Prior | None
) -> str:
    """What either method doubts about the coefficient, what they took differently, what else could tell."""
    reasons = []
    for method in (first, second):
        about = [doubt.clause for doubt in method.doubts if one.name in doubt.about]
        if about:
            reasons.append(f"{method.method} doubts it itself ({'; '.join(about)})")
        elif method.outcome is not Outcome.CONVERGED:
            reasons.append(f"{method.method} ended with '{method.outcome.value}'")
    reasons += _other_levels(DOFS[OF_HULL[one.name].dof], first, second)
    if not reasons:
        reasons.append("neither doubts it, and they took noise and disturbance alike")
    reasons += [*_entangled(one, other, first, second), *_beside(one, other, first, second, prior)]
    return "; ".join(reasons)


def _other_levels(axis: str, first: Identification, second: Identification) -> list[str]:
    """The noise levels and time constants of an axis that the two took differently, where both state them."""
    told = []
    for level_of, level in first.nuisance.items():
        other = second.nuisance.get(level_of, math.nan)
        asked = level_of.axis == axis and level_of.quantity is not Quantity.TRIM
        if asked and min(level, other) > 0 and max(level, other) > OTHER_LEVEL * min(level, other):
            words, unit = f"{level_of.channel} {LEVELS[level_of.quantity]}".strip(), WRITTEN[level_of.unit]
            taken = f"{first.method} {level:.2g} {unit}, {second.method} {other:.2g} {unit}"
            told.append(f"they take the {words} in {axis} differently ({taken})")
    return told


def _entangled(one: Estimate, other: Estimate, first: Identification, second: Identification) -> list[str]:
    """What the coefficient is most entangled with, by either method."""
    told: dict[str, list[str]] = {}
    for method, found in ((first, one), (second, other)):
        if found.partner is not None and found.partner.is_close:
            told.setdefault(_correlated(found.partner), []).append(method.method)
    words = " and ".join(f"{correlated} by {' and '.join(by)}" for correlated, by in told.items())
    return [f"{one.name} is correlated {words}"] if told else []


def _percent(of: Difference) -> float:
    return 100 * (of.second.value / of.first.value - 1)


def _correlated(partner: Partner) -> str:
    return f"{partner.correlation:+.2f} with {partner.name}"


def _beside(
    one: Estimate, other: Estimate, first: Identification, second: Identification, prior: Prior | None
) -> list[str]:
    """Which of the two is nearer to what was known before the dive, where that tells them apart."""
    if prior is None:
        return []
    away = [abs(math.log(found.value / prior.value)) for found in (one, other)]
    nearer = first if away[0] < away[1] else second
    return [
        f"the vehicle file's prior {prior.value:.4g} ± {prior.std:.2g} {one.unit} is nearer to {nearer.method}"
    ]


def _number(value: float) -> float | None:
    return value if math.isfinite(value) else None
