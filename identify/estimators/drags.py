"""Joint knowledge of linear and quadratic damping of a hull, for dives at few speeds that can't separate the two.

The fit is in logarithms, and so is the knowledge of a coefficient that is known well. If a damping is known loosely,
it may as well be zero, which a logarithm can't express. Drag is linear in its coefficients, so its likelihood is a
parabola in them. Their mean and covariance are those of a normal distribution truncated to positive values (Johnson,
Kotz and Balakrishnan 1994, section 13.10.1), and truncating one of them moves all that is correlated with it.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from identify.estimators.likelihood_axis import DAMPING
from identify.estimators.likelihood_joint import JointLikelihood
from identify.estimators.scoring import Maximum
from identify.identification import Z95

Array = NDArray[np.float64]

LOOSE = 0.25
"""Standard error of a logarithm above which a drag is stated as a number."""

VAGUE = 2.0
"""Prior standard deviation of a drag, as a share of the start value of its climb."""

SURELY = 5.0
"""Standard errors from 0 beyond which the negative part of a normal distribution is negligible."""


@dataclass(frozen=True)
class Told:
    """Knowledge of a fit's theta: its `middle` (p,) and `covariance` (p, p). For the drags at the indices in
    `stretch` these are the logarithm of the mean and the relative covariance; `stretch` holds factors on the lower
    and the upper half of their intervals."""

    middle: Array
    covariance: Array
    stretch: dict[int, tuple[float, float]]


def told(joint: JointLikelihood, maximum: Maximum) -> Told:
    """Return the knowledge of all axes; drags that are known loosely are treated as numbers."""
    whole: Array = np.asarray(np.linalg.inv(maximum.precision), dtype=np.float64)
    loose = _loose(joint, np.sqrt(np.diag(whole)))
    return _as_numbers(joint, maximum.theta, loose) if loose else Told(maximum.theta, whole, {})


def _loose(joint: JointLikelihood, std: Array) -> list[int]:
    """Indices in theta of linear and quadratic damping, for axes in which either is known loosely; std (p,)."""
    places: list[int] = []
    for problem, place in zip(joint.problems, joint.places, strict=True):
        both = [place.start + DAMPING, place.start + problem.quadratic_place]
        if problem.damped == "both" and np.max(std[both]) > LOOSE:
            places += both
    return places


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
    # The least certain damping first, because the other follows it.
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
    """95 % interval of a normal distribution truncated to positive values; it starts at 0 if zero is plausible."""
    from scipy.special import (
        log_ndtr,
        ndtri_exp,
    )  # here, because its import takes 0.15 s and few drags need it

    # In logarithms, because far out on the negative side the remaining probability would be rounded away.
    left = float(log_ndtr(middle / std))
    low, high = (middle - std * float(ndtri_exp(left + np.log(share))) for share in (0.975, 0.025))
    return (0.0 if middle < Z95 * std else low), high


def _without_negative(mean: Array, covariance: Array, place: int) -> tuple[Array, Array]:
    """Mean (p,) and covariance (p, p) once the parameter at `place` can't be negative."""
    std = float(np.sqrt(covariance[place, place]))
    off = float(mean[place]) / std
    if off > SURELY:
        return mean, covariance
    from scipy.special import log_ndtr

    # The hazard of a normal distribution, in logarithms for the far side.
    hazard = float(np.exp(-0.5 * off**2 - 0.5 * np.log(2.0 * np.pi) - log_ndtr(off)))
    left = max(1.0 - hazard * (hazard + off), 1e-6)
    along: Array = covariance[:, place] / std
    return mean + along * hazard, covariance - np.outer(along, along) * (1.0 - left)
