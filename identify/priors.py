"""Joins prior knowledge with the result of a dive, including the thrust scale that all of it depends on.

Everything is Gaussian in logarithms, so the joint result is the product of the two, exact if the likelihood is
quadratic. The state holds the logarithms of the coefficients given the vehicle file's thrust, and the logarithm of
the factor by which that thrust is wrong. This factor scales all masses and dampings that were found through thrust,
and no dive without a force standard can determine it. A prior that was weighed measures the sum of a coefficient's
logarithm and the factor's; a prior that was identified with the same thrust measures the coefficient's alone. Each
prior is a scalar measurement of that state (Kalman 1960, eqs 21 to 25, without motion).
"""

import math
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from bridge.arrays import Array
from bridge.vehicle.coefficients import BY_NAME, OF_HULL
from bridge.vehicle.config import Prior, dive_mark
from identify.doubt import Culprit, Doubt, Outcome
from identify.identification import LARGEST_RELATIVE_STD, Estimate, Identification, ThrustScale
from identify.statistics import Z95
from identify.words import decimals_for, fixed

CONFLICT_SIGMA = 3.0
"""A prior further than this from the dive is left out: one of the two is wrong, and their mean would be wrong too."""


@dataclass(frozen=True)
class Known:
    """Logarithms of coefficients, `mean` (n + 1,) and `covariance`; the last entry is the thrust factor.

    `moved` (n,): 1 if the thrust factor scales the coefficient, 0 if the righting moment scaled it.
    """

    of: tuple[str, ...]
    mean: Array
    covariance: Array
    moved: Array

    def tells_thrust(self, name: str, prior: Prior) -> bool:
        """Whether a prior is a force standard for the thrust."""
        return prior.rests_on == "weight" and bool(self.moved[self.of.index(name)])

    def row(self, name: str, prior: Prior) -> Array:
        """Measurement row of a prior over the state, (n + 1,)."""
        measured = np.zeros(len(self.mean))
        measured[self.of.index(name)] = 1.0
        measured[-1] = 1.0 if self.tells_thrust(name, prior) else 0.0
        return measured

    def distance(self, name: str, prior: Prior) -> float:
        """Distance of a prior from the current knowledge, in standard deviations of their difference."""
        row = self.row(name, prior)
        spread = math.sqrt(row @ self.covariance @ row + relative_std(prior) ** 2)
        return float((math.log(prior.value) - row @ self.mean) / spread)

    def joined(self, name: str, prior: Prior) -> "Known":
        row = self.row(name, prior)
        cross = self.covariance @ row
        gain = cross / (row @ cross + relative_std(prior) ** 2)
        mean = self.mean + gain * (math.log(prior.value) - row @ self.mean)
        return Known(self.of, mean, self.covariance - np.outer(gain, cross), self.moved)

    def with_all(self, priors: Mapping[str, Prior]) -> "Known":
        known = self
        for name, prior in priors.items():
            known = known.joined(name, prior)
        return known


def relative_std(prior: Prior) -> float:
    return prior.std / prior.value


def with_priors(answer: Identification, priors: Mapping[str, Prior], scale_std: float) -> Identification:
    """Return the identification joined with the priors, with the remaining thrust uncertainty and the priors' shares.

    If no prior was weighed, `std`, `low95` and `high95` hold given the vehicle file's thrust, and each estimate's
    `scale_std` gives the rest. If a prior was weighed, the intervals include all remaining thrust uncertainty. A
    prior that conflicts with the dive, or with the dive and the other priors together, is left out and reported as
    a doubt. A prior that rests on this very dive (or on another copy of its recording), directly or through an
    identification that had such a prior, is left out and named. A coefficient that the dive says nothing about
    takes its prior's value and stays not identifiable.
    """
    marks = set(filter(None, map(dive_mark, (answer.dive_sha256, answer.dive_opening))))
    reused = [name for name, prior in priors.items() if marks.intersection(prior.dives)]
    priors = {name: prior for name, prior in priors.items() if name not in reused}
    alone = _known(answer, scale_std)
    here = {name: prior for name, prior in priors.items() if name in alone.of}
    near = {name: p for name, p in here.items() if abs(alone.distance(name, p)) <= CONFLICT_SIGMA}
    combined = {name: alone.with_all({n: p for n, p in near.items() if n != name}) for name in near}
    taken = {name: p for name, p in near.items() if abs(combined[name].distance(name, p)) <= CONFLICT_SIGMA}
    conflicts = [_conflict(answer[name], p, alone) for name, p in here.items() if name not in near]
    if len(taken) < len(near):
        # If priors contradict each other, each may still fit the dive on its own: the right prior can't be picked
        # out.
        conflicts.append(_contradiction(near, combined))
        taken = {}
    known = alone.with_all(taken)
    weighed = any(known.tells_thrust(name, prior) for name, prior in taken.items())
    held = {name for doubt in answer.doubts if doubt.outcome is Outcome.AT_BOUND for name in doubt.about}
    before, (mean, covariance) = _reported(alone, weighed)[1], _reported(known, weighed)
    parameters = [
        _after(parameter, known.of.index(parameter.name), before, mean, covariance)
        if taken and parameter.name in known.of and parameter.name not in held
        else _of_prior_alone(parameter, priors)
        if parameter.name not in known.of
        else parameter
        for parameter in answer.parameters
    ]
    left = {name: scale_std * m for name, m in zip(known.of, known.moved, strict=True)} if not weighed else {}
    given = alone.with_all({n: p for n, p in taken.items() if not known.tells_thrust(n, p)})
    values = np.exp(mean)
    return replace(
        answer,
        parameters=tuple(
            replace(_given(parameter, given), scale_std=left.get(parameter.name, 0.0) * parameter.value)
            for parameter in parameters
        ),
        covariance=covariance * np.outer(values, values) if known.of else answer.covariance,
        covariance_of=known.of if known.of else answer.covariance_of,
        doubts=(*answer.doubts, *conflicts, *_of_this_dive(reused)),
        notes=(*answer.notes, *_words(priors, taken, known.of)),
        thrust_scale=_scale(answer, known, weighed, scale_std),
        prior_dives=tuple(dict.fromkeys(dive for prior in taken.values() for dive in prior.dives)),
    )


def _known(answer: Identification, scale_std: float) -> Known:
    """State from the dive alone, in logarithms, without the coefficients that a doubt left without a value."""
    value = {parameter.name: parameter.value for parameter in answer.parameters}
    kept = [i for i, name in enumerate(answer.covariance_of) if math.isfinite(value[name])]
    names = tuple(answer.covariance_of[i] for i in kept)
    values = np.array([value[name] for name in names])
    covariance = np.zeros((len(names) + 1, len(names) + 1))
    covariance[:-1, :-1] = answer.covariance[np.ix_(kept, kept)] / np.outer(values, values)
    covariance[-1, -1] = scale_std**2
    moved = np.array([0.0 if name in answer.rest_on_righting else 1.0 for name in names])
    return Known(names, np.append(np.log(values), 0.0), covariance, moved)


def _given(parameter: Estimate, given: Known) -> Estimate:
    """The estimate with its value and standard error given the vehicle file's thrust."""
    if parameter.name not in given.of:
        return parameter
    place = given.of.index(parameter.name)
    value = float(np.exp(given.mean[place]))
    return replace(
        parameter, given_thrust=value, given_thrust_std=value * math.sqrt(given.covariance[place, place])
    )


def _reported(known: Known, weighed: bool) -> tuple[Array, Array]:
    """Mean and covariance of the coefficients: with the thrust factor if a force standard was weighed, else given the
    thrust."""
    to = np.hstack([np.eye(len(known.of)), (known.moved if weighed else 0.0 * known.moved)[:, None]])
    return to @ known.mean, to @ known.covariance @ to.T


def _after(parameter: Estimate, place: int, before: Array, mean: Array, covariance: Array) -> Estimate:
    """The estimate after the priors; its interval keeps its asymmetry. `before` is the covariance without them."""
    value, std = float(np.exp(mean[place])), float(np.sqrt(covariance[place, place]))
    below, above = _stretch(parameter)
    identifiable = std * max(below, above) <= LARGEST_RELATIVE_STD
    return replace(
        parameter,
        value=value,
        std=value * std,
        low95=value * math.exp(-Z95 * std * below),
        high95=value * math.exp(Z95 * std * above),
        identifiable=identifiable,
        reason="" if identifiable else parameter.reason,
        share_from_prior=min(max(1.0 - float(covariance[place, place] / before[place, place]), 0.0), 1.0),
    )


def _stretch(parameter: Estimate) -> tuple[float, float]:
    """Distances of the interval's ends from the value, relative to those of a Gaussian in the logarithm."""
    if not 0 < parameter.low95 < parameter.value < parameter.high95:
        return 1.0, 1.0
    half = Z95 * parameter.relative_std
    return math.log(parameter.value / parameter.low95) / half, math.log(
        parameter.high95 / parameter.value
    ) / half


def _of_prior_alone(parameter: Estimate, priors: Mapping[str, Prior]) -> Estimate:
    if parameter.name not in priors or math.isfinite(parameter.value):
        return parameter
    prior = priors[parameter.name]
    std = relative_std(prior)
    return replace(
        parameter,
        value=prior.value,
        std=prior.std,
        low95=prior.value * math.exp(-Z95 * std),
        high95=prior.value * math.exp(Z95 * std),
        identifiable=False,
        reason=f"{parameter.reason.rstrip('.')}; its value here is the vehicle file's prior alone{_source(prior)}",
        share_from_prior=1.0,
    )


def _conflict(parameter: Estimate, prior: Prior, known: Known) -> Doubt:
    return Doubt(
        (parameter.name,),
        f"The vehicle file's prior of {parameter.name}, {_plus_minus(prior)} "
        f"{parameter.unit}{_source(prior)}, and the dive's {_plus_minus(parameter)} are "
        f"{abs(known.distance(parameter.name, prior)):.1f} standard errors apart",
        "the prior was left out; see what changed on the vehicle, or weigh it anew.",
        Outcome.DISAGREES,
    )


def _contradiction(near: Mapping[str, Prior], known: Mapping[str, Known]) -> Doubt:
    apart = {name: abs(known[name].distance(name, prior)) for name, prior in near.items()}
    worst = max(apart, key=lambda name: apart[name])
    listed = ", ".join(f"{n} {_plus_minus(p)} {OF_HULL[n].unit}{_source(p)}" for n, p in near.items())
    return Doubt(
        tuple(near),
        f"The vehicle file's priors contradict each other, {worst} the others by {apart[worst]:.1f} standard errors "
        "once the dive ties them together",
        f"none of them was taken ({listed}); weigh them anew, and take the wrong one out.",
        Outcome.DISAGREES,
    )


def _of_this_dive(names: Collection[str]) -> tuple[Doubt, ...]:
    if not names:
        return ()
    listed = ", ".join(names)
    problem = (
        f"The vehicle file's priors of {listed} rest on this very dive, by themselves or through a later one"
    )
    remedy = "they were left out, for a dive does not confirm itself."
    return (Doubt(tuple(names), problem, remedy, culprit=Culprit.PRIOR),)


def _plus_minus(of: Prior | Estimate) -> str:
    decimals = decimals_for(of.std)
    return f"{fixed(of.value, decimals)} ± {fixed(of.std, decimals)}"


def _source(prior: Prior) -> str:
    return f" ({prior.source})" if prior.source else ""


def _words(priors: Mapping[str, Prior], taken: Mapping[str, Prior], fitted: Sequence[str]) -> tuple[str, ...]:
    if not priors:
        return ()
    if not fitted:
        return ("The method states no interval, so the vehicle file's priors were not joined with it.",)
    if not taken:
        return ()
    names = ", ".join(f"{name} {_plus_minus(p)} {OF_HULL[name].unit}" for name, p in taken.items())
    return (f"Priors of the vehicle file are part of the values: {names}.",)


def _scale(answer: Identification, known: Known, weighed: bool, scale_std: float) -> ThrustScale | None:
    """State of the thrust factor after the dive; None if thrust is known exactly, or no value depends on it."""
    if scale_std == 0.0 or not answer.values():
        return None
    if not weighed:
        sentence = (
            f"The intervals include what the vehicle file's thrust may be off by: it is known to {100 * scale_std:.2g} "
            "% (one standard deviation), and were it 1 % stronger, every mass and damping that thrust weighs would be "
            "1 % larger. Given that thrust, the narrower intervals hold; they compare dives of one vehicle."
        )
        return ThrustScale(0.0, scale_std, False, sentence)
    shift, std = float(known.mean[-1]), float(np.sqrt(known.covariance[-1, -1]))
    sentence = (
        f"The intervals include what the thrust may be off by: with the weighed priors it is "
        f"{100 * math.expm1(shift):+.1f} % off the vehicle file's, known to {100 * std:.2g} % "
        f"({100 * scale_std:.2g} % before)."
    )
    return ThrustScale(math.expm1(shift), std, True, sentence)


def values_sent(
    intervals: Iterable[tuple[str, float, float]], thrust_shift: float, *, with_effects: bool
) -> dict[str, tuple[float, float]]:
    """Value and relative standard deviation of each coefficient that a vehicle was sent, from its 95 % interval.

    They are for the thrust of the vehicle file: a relative shift of the thrust, contained in the values, is taken out.
    with_effects: whether effects were sent too. Next to them quadratic drag is itself an effect, of a hull that has
    none.
    """
    known = BY_NAME if with_effects else OF_HULL
    return {
        name: (math.sqrt(low * high) / (1.0 + thrust_shift), math.log(high / low) / (2 * Z95))
        for name, low, high in intervals
        if name in known and 0 < low < high
    }
