"""Slow forces that the disturbance absorbed: one axis forgets far more slowly than the others.

A disturbance of free correlation time follows any force that changes slowly, and its filter's innovations are then as
white as without the force. But one sea moves all axes, with one memory. So each axis's filter is compared with a
filter whose disturbance forgets as it does in the other axes, with all else fitted again. A sea that is smoother than
a first-order one is likelier with a longer correlation time, too; only a disturbance that is still correlated with
itself long after that time counts as slow.
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from identify.diagnose.nominal import NEARLY, Nominal
from identify.estimators.likelihood_axis import TIME_CONSTANT, AxisLikelihood
from identify.estimators.likelihood_joint import alone
from identify.estimators.scoring import climb

Array = NDArray[np.float64]

SLOWER, FORGOTTEN = 1.5, 4.0
"""Correlation time, in those of the other axes, that a sea may have in one axis, and the lag at which it is
forgotten."""

LEAST_CORRELATION, LEAST_SIGMA = 0.3, 4.0
"""Correlation at that lag that no sea has left, and the same in its standard errors."""

FEW, USUAL_S = 2, 4.0
"""With fewer other axes, their correlation time counts as this one: a slow sea's, s."""

HELD = 1e6
"""Precision of a logarithm that is held fixed."""


@dataclass(frozen=True)
class Slow:
    """A slow force (n,), N or N m, along a dive's course, in one degree of freedom; gain: nats that it saves."""

    dof: int
    force: Array
    gain: float


def slow_axes(now: Nominal) -> dict[int, float]:
    """Degrees of freedom whose disturbance forgets more slowly than a sea's, with the sea's correlation time, s.

    Left out are doubted and `untold` ones, and those behind an autopilot's filter, whose correlation time is held.
    """
    left_out = {*now.filtered, *now.doubted, *now.untold}
    # These do not tell the sea's memory either: behind a filter it is held, not found.
    times_s = {
        problem.axis.dof: float(np.exp(now.theta[place][TIME_CONSTANT]))
        for problem, place in zip(now.joint.problems, now.joint.places, strict=True)
        if problem.axis.dof not in left_out
    }
    others_s = {dof: [time_s for k, time_s in times_s.items() if k != dof] for dof in times_s}
    seas_s = {dof: float(np.median(s)) if len(s) >= FEW else USUAL_S for dof, s in others_s.items()}
    return {
        problem.axis.dof: sea_s
        for problem, place in zip(now.joint.at(now.theta), now.joint.places, strict=True)
        if problem.axis.dof in times_s
        and times_s[problem.axis.dof] > SLOWER * (sea_s := seas_s[problem.axis.dof])
        and not _forgets(_disturbance(problem, now.theta[place], now), sea_s, now)
    }


def _disturbance(problem: AxisLikelihood, theta: Array, now: Nominal) -> Array:
    return np.interp(now.course.time_s, problem.axis.time_s, problem.means(theta)[:, 2])


def _forgets(force: Array, sea_s: float, now: Nominal) -> bool:
    """Whether a disturbance (n,) is forgotten as soon as a sea's, or the dive is too short to say.

    The correlation of a first-order sea with itself is known to the standard error of Bartlett (1946).
    """
    lasting_s, later_s = float(now.course.since_s[-1]), FORGOTTEN * sea_s
    if later_s > 0.5 * lasting_s:
        return True
    sigma = np.sqrt(sea_s / (lasting_s - later_s))
    left = _correlation(force, later_s / now.course.step_s)
    return left < max(LEAST_CORRELATION, LEAST_SIGMA * float(sigma))


def slow_forces(now: Nominal) -> tuple[Slow, ...]:
    """The slow forces in these degrees of freedom."""
    seas_s = slow_axes(now)
    return tuple(
        _slow(problem, now.theta[place], now, seas_s[problem.axis.dof])
        for problem, place in zip(now.joint.at(now.theta), now.joint.places, strict=True)
        if problem.axis.dof in seas_s
    )


def _slow(problem: AxisLikelihood, theta: Array, now: Nominal, sea_s: float) -> Slow:
    free = climb(problem, theta, NEARLY, alone).theta
    mean, precision, start = problem.prior_mean.copy(), problem.prior_precision.copy(), theta.copy()
    mean[TIME_CONSTANT] = start[TIME_CONSTANT] = np.log(SLOWER * sea_s)
    precision[TIME_CONSTANT] = HELD
    held = climb(replace(problem, prior_mean=mean, prior_precision=precision), start, NEARLY, alone).theta
    gain = problem.log_likelihood(free) - problem.log_likelihood(held)
    return Slow(problem.axis.dof, _disturbance(problem, free, now), gain)


def _correlation(values: Array, steps: float) -> float:
    """Correlation of a series (n,) with itself so many steps later; 0 for a constant series."""
    later = min(max(round(steps), 1), len(values) - 2)
    off = values - values.mean()
    return float(off[:-later] @ off[later:] / max(float(off @ off), 1e-300) * len(off) / (len(off) - later))
