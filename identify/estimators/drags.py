"""Linear and quadratic damping of one hull, which a dive at few speeds can't tell apart: what is known of each.

The fit is in logarithms, and so is what is known of a coefficient, as long as that is much. Where it is little, one of
the two may as well be absent, which no logarithm can say. Drag is linear in its coefficients, so that its likelihood is
a parabola in them: their mean and covariance are those of a normal distribution without its negative part (Johnson,
Kotz and Balakrishnan 1994, section 13.10.1), and what that leaves of one moves all that is correlated with it.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.special import log_ndtr, ndtri_exp

from identify.estimators.likelihood_axis import DAMPING
from identify.estimators.likelihood_joint import JointLikelihood
from identify.estimators.scoring import Maximum
from identify.identification import Z95

Array = NDArray[np.float64]

LOOSE = 0.25
"""Standard error of a logarithm from which on a drag is told as a number."""

VAGUE = 2.0
"""Standard deviation of a drag beforehand, as a share of where its climb starts."""

SURELY = 5.0
"""Standard errors from 0 at which a normal distribution has no negative part."""


@dataclass(frozen=True)
class Told:
    """What is known of a fit's theta: its `middle` (p,) and `covariance` (p, p). Of the drags at the places of
    `stretch` these are the logarithm of the mean and the relative covariance; with it what to multiply the lower and
    the upper half of their intervals by."""

    middle: Array
    covariance: Array
    stretch: dict[int, tuple[float, float]]


def told(joint: JointLikelihood, maximum: Maximum) -> Told:
    """Of all axes; as numbers of the drags that are known loosely."""
    whole: Array = np.asarray(np.linalg.inv(maximum.precision), dtype=np.float64)
    loose = _loose(joint, np.sqrt(np.diag(whole)))
    return _as_numbers(joint, maximum.theta, loose) if loose else Told(maximum.theta, whole, {})


def _loose(joint: JointLikelihood, std: Array) -> list[int]:
    """Where theta has linear and quadratic damping of the axes in which one of them is known loosely; std (p,)."""
    found: list[int] = []
    for problem, place in zip(joint.problems, joint.places, strict=True):
        both = [place.start + DAMPING, place.start + problem.quadratic_place]
        if problem.damped == "both" and np.max(std[both]) > LOOSE:
            found += both
    return found


def _as_numbers(joint: JointLikelihood, theta: Array, at: list[int]) -> Told:
    gradient, information = joint.score(theta)
    prior_mean, precision = joint.prior_mean.copy(), joint.prior_precision.copy()
    value, unit = theta.copy(), np.ones(len(theta))
    value[at] = unit[at] = np.exp(theta[at])
    prior_mean[at] = np.exp(prior_mean[at])
    precision[at] = (VAGUE * prior_mean[at]) ** -2.0
    covariance: Array = np.asarray(np.linalg.inv(information / np.outer(unit, unit) + np.diag(precision)))
    mean = value + covariance @ (gradient / unit - precision * (value - prior_mean))
    ends = {}
    # The least sure first: it is the one that the other follows.
    for place in sorted(at, key=lambda place: mean[place] / np.sqrt(covariance[place, place])):
        ends[place] = _interval(float(mean[place]), float(np.sqrt(covariance[place, place])))
        mean, covariance = _without_negative(mean, covariance, place)
    unit[at] = mean[at]
    middle, relative = mean.copy(), covariance / np.outer(unit, unit)
    middle[at] = np.log(mean[at])
    half = {place: Z95 * float(np.sqrt(relative[place, place])) for place in at}
    stretch = {
        place: (
            float(np.log(mean[place] / low)) / half[place],
            float(np.log(high / mean[place])) / half[place],
        )
        for place, (low, high) in ends.items()
    }
    return Told(middle, relative, stretch)


def _interval(middle: float, std: float) -> tuple[float, float]:
    """Of a normal distribution without its negative part, 95 %: from 0 where none at all may as well be."""
    # By logarithms: far out on the other side what is left would be rounded away.
    left = float(log_ndtr(middle / std))
    low, high = (middle - std * float(ndtri_exp(left + np.log(share))) for share in (0.975, 0.025))
    return (0.0 if middle < Z95 * std else low), high


def _without_negative(mean: Array, covariance: Array, place: int) -> tuple[Array, Array]:
    """Mean (p,) and covariance (p, p) once the parameter there can't be negative."""
    std = float(np.sqrt(covariance[place, place]))
    off = float(mean[place]) / std
    if off > SURELY:
        return mean, covariance
    # The hazard of a normal distribution, by logarithms for the far side.
    hazard = float(np.exp(-0.5 * off**2 - 0.5 * np.log(2.0 * np.pi) - log_ndtr(off)))
    left = max(1.0 - hazard * (hazard + off), 1e-6)
    along: Array = covariance[:, place] / std
    return mean + along * hazard, covariance - np.outer(along, along) * (1.0 - left)
