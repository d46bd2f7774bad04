"""What was known before the dive joined with what the dive tells, and the thrust that all of it rests on.

Everything is Gaussian in logarithms, so the joint answer is the product of the two: exact where the likelihood is
quadratic. The state is the coefficients given the vehicle file's thrust, and beside them the logarithm of the factor
that this thrust is off by, which moves all masses and dampings alike and which no dive without a force standard tells.
A prior that was weighed measures their sum, one that was identified with the same thrust the coefficient alone. Each
prior is a scalar measurement of that state (Kalman 1960, eqs 21 to 25, without motion).
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from bridge.vehicle.coefficients import BY_NAME
from bridge.vehicle.config import Prior
from identify.identification import (
    LARGEST_RELATIVE_STD,
    Z95,
    Doubt,
    Estimate,
    Identification,
    Outcome,
    ThrustScale,
)

Array = NDArray[np.float64]

CONFLICT_SIGMA = 3.0
"""A prior further than this from the dive is left out: one of the two is wrong, and their mean would be neither."""


@dataclass(frozen=True)
class Known:
    """Logarithms of coefficients: `mean` (n + 1,) and `covariance`; the last is the factor of the thrust, shared."""

    of: tuple[str, ...]
    mean: Array
    covariance: Array

    def row(self, name: str, prior: Prior) -> Array:
        """What a prior measures of the state, (n + 1,)."""
        measured = np.zeros(len(self.mean))
        measured[self.of.index(name)] = 1.0
        measured[-1] = 1.0 if prior.rests_on == "weight" else 0.0
        return measured

    def distance(self, name: str, prior: Prior) -> float:
        """How many standard deviations of their difference a prior is away from what is known without it."""
        row = self.row(name, prior)
        spread = math.sqrt(row @ self.covariance @ row + relative_std(prior) ** 2)
        return float((math.log(prior.value) - row @ self.mean) / spread)

    def joined(self, name: str, prior: Prior) -> "Known":
        """With one prior more."""
        row = self.row(name, prior)
        cross = self.covariance @ row
        gain = cross / (row @ cross + relative_std(prior) ** 2)
        mean = self.mean + gain * (math.log(prior.value) - row @ self.mean)
        return Known(self.of, mean, self.covariance - np.outer(gain, cross))


def relative_std(prior: Prior) -> float:
    return prior.std / prior.value


def with_priors(found: Identification, priors: Mapping[str, Prior], scale_std: float) -> Identification:
    """The identification with the priors in it, what is left of the thrust's factor, and the shares of the priors.

    Where no prior was weighed, intervals hold given the vehicle file's thrust, and `scale_std` stands beside them.
    Where one was, they include all that is left of it. A prior in conflict with the dive is left out and doubted. What
    the dive says nothing of takes its prior's value, and stays not identifiable.
    """
    known = _known(found, scale_std)
    here = {name: prior for name, prior in priors.items() if name in known.of}
    taken = {name: p for name, p in here.items() if abs(known.distance(name, p)) <= CONFLICT_SIGMA}
    conflicts = [_conflict(found[name], p, known) for name, p in here.items() if name not in taken]
    for name, prior in taken.items():
        known = known.joined(name, prior)
    weighed = any(prior.rests_on == "weight" for prior in taken.values())
    mean, covariance = _reported(known, weighed)
    parameters = [
        _after(one, known.of, mean, covariance, taken)
        if taken and one.name in known.of
        else _of_prior_alone(one, priors)
        if one.name not in known.of
        else one
        for one in found.parameters
    ]
    left = 0.0 if weighed else scale_std
    values = np.exp(mean)
    return replace(
        found,
        parameters=tuple(replace(one, scale_std=left * one.value) for one in parameters),
        covariance=covariance * np.outer(values, values) if known.of else found.covariance,
        covariance_of=known.of if known.of else found.covariance_of,
        doubts=(*found.doubts, *conflicts),
        notes=(*found.notes, *_words(priors, taken, known.of)),
        thrust_scale=_scale(found, known, weighed, scale_std),
    )


def _known(found: Identification, scale_std: float) -> Known:
    """What the dive alone told, as logarithms; coefficients that a doubt left without a value are not among them."""
    value = {one.name: one.value for one in found.parameters}
    kept = [i for i, name in enumerate(found.covariance_of) if math.isfinite(value[name])]
    of = tuple(found.covariance_of[i] for i in kept)
    values = np.array([value[name] for name in of])
    covariance = np.zeros((len(of) + 1, len(of) + 1))
    covariance[:-1, :-1] = found.covariance[np.ix_(kept, kept)] / np.outer(values, values)
    covariance[-1, -1] = scale_std**2
    return Known(of, np.append(np.log(values), 0.0), covariance)


def _reported(known: Known, weighed: bool) -> tuple[Array, Array]:
    """Mean and covariance of the coefficients: their own where a force standard was weighed, else given the thrust."""
    to = np.hstack([np.eye(len(known.of)), np.full((len(known.of), 1), 1.0 if weighed else 0.0)])
    return to @ known.mean, to @ known.covariance @ to.T


def _after(
    one: Estimate, of: Sequence[str], mean: Array, covariance: Array, taken: Mapping[str, Prior]
) -> Estimate:
    place = of.index(one.name)
    value, std = float(np.exp(mean[place])), float(np.sqrt(covariance[place, place]))
    share = (std / relative_std(taken[one.name])) ** 2 if one.name in taken else 0.0
    return replace(
        one,
        value=value,
        std=value * std,
        low95=value * math.exp(-Z95 * std),
        high95=value * math.exp(Z95 * std),
        identifiable=std <= LARGEST_RELATIVE_STD,
        reason="" if std <= LARGEST_RELATIVE_STD else one.reason,
        share_from_prior=min(share, 1.0),
    )


def _of_prior_alone(one: Estimate, priors: Mapping[str, Prior]) -> Estimate:
    if one.name not in priors or math.isfinite(one.value):
        return one
    prior = priors[one.name]
    std = relative_std(prior)
    return replace(
        one,
        value=prior.value,
        std=prior.std,
        low95=prior.value * math.exp(-Z95 * std),
        high95=prior.value * math.exp(Z95 * std),
        identifiable=False,
        reason=f"{one.reason.rstrip('.')}; its value here is the vehicle file's prior alone{_source(prior)}",
        share_from_prior=1.0,
    )


def _conflict(one: Estimate, prior: Prior, known: Known) -> Doubt:
    sentence = (
        f"The vehicle file's prior of {one.name}, {prior.value:.4g} ± {prior.std:.2g} {one.unit}{_source(prior)}, and "
        f"the dive's {one.value:.4g} ± {one.std:.2g} are {abs(known.distance(one.name, prior)):.1f} standard errors "
        "apart: the prior was left out; see what changed on the vehicle, or weigh it anew."
    )
    return Doubt((one.name,), sentence, Outcome.DISAGREES)


def _source(prior: Prior) -> str:
    return f" ({prior.source})" if prior.source else ""


def _words(priors: Mapping[str, Prior], taken: Mapping[str, Prior], fitted: Sequence[str]) -> tuple[str, ...]:
    if not priors:
        return ()
    if not fitted:
        return ("The method states no interval, so the vehicle file's priors were not joined with it.",)
    if not taken:
        return ()
    names = ", ".join(f"{name} {p.value:.4g} ± {p.std:.2g} {BY_NAME[name].unit}" for name, p in taken.items())
    return (f"Priors of the vehicle file are part of the values: {names}.",)


def _scale(found: Identification, known: Known, weighed: bool, scale_std: float) -> ThrustScale | None:
    """How the thrust's factor stands after the dive; None where thrust is known, or nothing that hangs on it."""
    if scale_std == 0.0 or not found.values():
        return None
    if not weighed:
        sentence = (
            f"The intervals hold given the vehicle file's thrust, which is known to {100 * scale_std:.2g} % (one "
            "standard deviation): were it 1 % stronger, every mass and damping would be 1 % larger."
        )
        return ThrustScale(0.0, scale_std, False, sentence)
    shift, std = float(known.mean[-1]), float(np.sqrt(known.covariance[-1, -1]))
    sentence = (
        f"The intervals include what the thrust may be off by: with the weighed priors it is "
        f"{100 * math.expm1(shift):+.1f} % off the vehicle file's, known to {100 * std:.2g} % "
        f"({100 * scale_std:.2g} % before)."
    )
    return ThrustScale(math.expm1(shift), std, True, sentence)
