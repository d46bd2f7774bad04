"""Compares two methods on one dive: where they disagree beyond their intervals, and why.

They disagree on a coefficient if each value lies outside the other's 95 % interval, by an amount that matters. Both
methods saw the same noise, so their difference spreads less than the root of the sum of their variances. For an
efficient estimator and another estimator of the same truth, the variance of the difference is the difference of the
variances (Hausman 1978, lemma 2.1), at most the larger of the two. So a difference beyond both intervals is not
chance, whichever method is efficient.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any, Protocol

from bridge.vehicle.coefficients import DOFS, OF_HULL
from bridge.vehicle.config import Prior
from identify.doubt import Doubt, Outcome, worst
from identify.identification import Estimate, Identification
from identify.nuisance import WRITTEN, Quantity
from identify.words import capital

LEAST_DIFFERENCE = 0.005
"""As a share of the value. A smaller difference has no practical effect: the thrust behind all values is known to
some per cent, and a controller's feed-forward does not notice it."""

OTHER_LEVEL = 1.5
"""Two fitted noise levels differ if their ratio exceeds this."""

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
    """A coefficient by both methods. `distance`: second less first, in the larger of the two standard errors.

    The distance is NaN if either has no value. `why` is a sentence if they disagree, otherwise empty.
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
    """The results of a first and a second method for the same dive."""

    first: Identification
    second: Identification
    differences: tuple[Difference, ...]

    @property
    def disagreements(self) -> tuple[Difference, ...]:
        return tuple(d for d in self.differences if d.disagrees)

    @property
    def sentences(self) -> tuple[str, ...]:
        """A sentence for each disagreement, or a single sentence that says that there is none."""
        if reasons := tuple(d.why for d in self.disagreements):
            return reasons
        both = [d for d in self.differences if math.isfinite(d.distance)]
        names = f"{self.first.method} and {self.second.method}"
        if not both:
            return (f"No parameter has an interval by both {names}: there is nothing to compare.",)
        furthest = max(both, key=lambda d: abs(d.distance))
        percent = 100 * (furthest.second.value / furthest.first.value - 1)
        return (
            f"{capital(names)} agree in all {len(both)} parameters that both identify: at most "
            f"{abs(furthest.distance):.2g} standard errors apart, in {furthest.name} ({percent:+.2g} %).",
        )

    def to_json(self) -> dict[str, Any]:
        """The entry `comparison` of the first method's JSON."""
        return {
            "method": self.second.method,
            "outcome": self.second.outcome.value,
            "wall_s": self.second.wall_s,
            "parameters": [
                {**d.second.to_json(), "difference_in_std": d.distance, "disagrees": d.disagrees}
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
    """Compare the coefficients of both, in the order of the first; `priors` of the vehicle file help to say who is
    right."""
    by_name = {parameter.name: parameter for parameter in second.parameters}
    differences = [
        _difference(
            _Side(first, parameter),
            _Side(second, by_name[parameter.name]),
            (priors or {}).get(parameter.name),
        )
        for parameter in first.parameters
        if parameter.name in by_name and parameter.name in OF_HULL
    ]
    return Comparison(first, second, tuple(differences))


def doubted(compared: Comparison) -> Identification:
    """The first method's result, with a doubt about each coefficient on which the second disagrees."""
    doubts = tuple(
        Doubt((d.name,), d.why, outcome=Outcome.DISAGREES, also=_partners(d)) for d in compared.disagreements
    )
    if not doubts:
        return compared.first
    outcome = worst((compared.first.outcome, Outcome.DISAGREES))
    return replace(compared.first, outcome=outcome, doubts=(*compared.first.doubts, *doubts))


@dataclass(frozen=True)
class _Side:
    """A method with its estimate of the coefficient that is compared."""

    method: Identification
    estimate: Estimate

    @property
    def name(self) -> str:
        return self.method.method


def _difference(first: _Side, second: _Side, prior: Prior | None) -> Difference:
    value, other = first.estimate, second.estimate
    distance = distance_between(value, other)
    if not (math.isfinite(distance) and apart(value, other)):
        return Difference(value.name, value, other, distance)
    why = (
        f"On {value.name} two methods disagree, {first.name} {value.value:.4g} ± {value.std:.2g} {value.unit} and "
        f"{second.name} {other.value:.4g} ± {other.std:.2g}, {100 * (other.value / value.value - 1):+.1f} % and "
        f"{abs(distance):.1f} standard errors apart: {_why(first, second, prior)}; rely on neither value before "
        "another dive tells (`seatrial plan --after` proposes one)."
    )
    return Difference(value.name, value, other, distance, why)


def apart(interval: Interval, other: Interval) -> bool:
    """Whether each value lies outside the other's 95 % interval, and they differ by at least LEAST_DIFFERENCE."""
    outside = all(not a.low95 <= b.value <= a.high95 for a, b in ((interval, other), (other, interval)))
    return outside and abs(other.value / interval.value - 1) >= LEAST_DIFFERENCE


def distance_between(parameter: Estimate, other: Estimate) -> float:
    """Difference of logarithms, `other` less `parameter`, in the larger of their standard errors; NaN if either is
    unusable."""
    usable = parameter.identifiable and other.identifiable and parameter.value > 0 and other.value > 0
    stds = (parameter.relative_std, other.relative_std) if usable else (math.nan, math.nan)
    return math.log(other.value / parameter.value) / max(stds) if all(std > 0 for std in stds) else math.nan


def _why(first: _Side, second: _Side, prior: Prior | None) -> str:
    """Reasons for a disagreement: each method's doubts about the coefficient, their different assumptions, and other
    evidence."""
    name, reasons = first.estimate.name, []
    for side in (first, second):
        about = [doubt.clause for doubt in side.method.doubts if name in doubt.about]
        if about:
            reasons.append(f"{side.name} doubts it itself ({'; '.join(about)})")
        elif side.method.outcome is not Outcome.CONVERGED:
            reasons.append(f"{side.name} ended with '{side.method.outcome.value}'")
    reasons += _other_levels(DOFS[OF_HULL[name].dof], first.method, second.method)
    if not reasons:
        reasons.append("neither doubts it, and they took noise and disturbance alike")
    return "; ".join([*reasons, *_entangled(first, second), *_nearer_to_prior(first, second, prior)])


def _other_levels(axis: str, first: Identification, second: Identification) -> list[str]:
    """The noise levels and time constants of an axis on which the two methods differ, among those that both state."""
    differing = []
    for fitted, level in first.nuisance.items():
        second_level = second.nuisance.get(fitted, math.nan)
        comparable = (
            fitted.axis == axis and fitted.quantity is not Quantity.TRIM and min(level, second_level) > 0
        )
        if comparable and max(level, second_level) > OTHER_LEVEL * min(level, second_level):
            words, unit = f"{fitted.channel} {LEVELS[fitted.quantity]}".strip(), WRITTEN[fitted.unit]
            taken = f"{first.method} {level:.2g} {unit}, {second.method} {second_level:.2g} {unit}"
            differing.append(f"they take the {words} in {axis} differently ({taken})")
    return differing


def _entangled(*sides: _Side) -> list[str]:
    """The coefficient that this coefficient correlates most with, by either method."""
    by_partner: dict[str, list[str]] = {}
    for side in sides:
        partner = side.estimate.partner
        if partner is not None and partner.is_close:
            by_partner.setdefault(f"{partner.correlation:+.2f} with {partner.name}", []).append(side.name)
    words = " and ".join(f"{correlated} by {' and '.join(by)}" for correlated, by in by_partner.items())
    return [f"{sides[0].estimate.name} is correlated {words}"] if by_partner else []


def _partners(of: Difference) -> tuple[str, ...]:
    """The coefficients that either method can't tell apart from this one."""
    partners = [each.partner for each in (of.first, of.second)]
    return tuple(dict.fromkeys(each.name for each in partners if each is not None and each.is_close))


def _nearer_to_prior(first: _Side, second: _Side, prior: Prior | None) -> list[str]:
    """Which of the two values is nearer to the vehicle file's prior, if there is a prior."""
    if prior is None:
        return []
    away = [abs(math.log(side.estimate.value / prior.value)) for side in (first, second)]
    nearer, unit = first if away[0] < away[1] else second, first.estimate.unit
    return [f"the vehicle file's prior {prior.value:.4g} ± {prior.std:.2g} {unit} is nearer to {nearer.name}"]


def further_remarks(compared: Comparison) -> tuple[str, ...]:
    """Further statements on both methods: outcome, doubts, reasons for missing values.

    That is: the outcome of the second if it did not converge, the doubts that only the second raises, and why either
    method gives no value, grouped by reason. Doubts of the same coefficients with the same remedy are the same, though
    their figures differ. If the first method gives no value at all, its own section already says why.
    """
    first, second = compared.first, compared.second
    ended = (
        ()
        if second.outcome is Outcome.CONVERGED
        else (f"{capital(second.method)} ended with '{second.outcome.value}'.",)
    )
    known = {(doubt.about, doubt.remedy) for doubt in first.doubts}
    doubts_of_second = dict.fromkeys(
        doubt.sentence for doubt in second.doubts if (doubt.about, doubt.remedy) not in known
    )
    doubts = tuple(f"{capital(second.method)}: {sentence}" for sentence in doubts_of_second)
    return (*ended, *doubts, *(_gaps(first, compared) if first.values() else ()), *_gaps(second, compared))


def _gaps(method: Identification, compared: Comparison) -> tuple[str, ...]:
    """Why a method has no value while the other has one, or no value at all; a line for each reason."""
    names: dict[str, list[str]] = {}
    bare = not method.values()
    for d in compared.differences:
        ours, theirs = (d.first, d.second) if method is compared.first else (d.second, d.first)
        if not ours.identifiable and (bare or theirs.identifiable):
            names.setdefault(ours.reason, []).append(d.name)
    nothing = bare and len(names) == 1
    return tuple(
        f"{capital(method.method)} gives {'nothing' if nothing else 'no ' + ', '.join(missing)}: {reason}"
        for reason, missing in names.items()
    )
