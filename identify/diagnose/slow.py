"""Slow forces that the disturbance absorbed: a longer correlation time than a sea's shows a force of the vehicle.

A disturbance of free correlation time follows any force that changes slowly, and its filter's innovations are then as
white as without the force. So each axis's filter is compared with a filter whose disturbance forgets as a sea's does,
with all else fitted again. A sea that is smoother than a first-order one is likelier with a longer correlation time,
too; only a disturbance that is still correlated with itself after that time counts as slow.
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from identify.diagnose.nominal import NEARLY, Nominal
from identify.estimators.likelihood_axis import TIME_CONSTANT, AxisLikelihood
from identify.estimators.scoring import climb

Array = NDArray[np.float64]

LONGEST_S = 6.0
"""Longest correlation time of a sea's disturbance, s: four times the usual."""

HELD = 1e6
"""Precision of a logarithm that is held fixed."""


@dataclass(frozen=True)
class Slow:
    """A slow force (n,), N or N m, along a dive's course, in one degree of freedom; gain: nats that it saves."""

    dof: int
    force: Array
    gain: float


def slow_axes(now: Nominal) -> tuple[int, ...]:
    """Degrees of freedom whose disturbance has a longer correlation time than a sea's.

    Left out are doubted and `untold` ones, and those behind an autopilot's filter, whose correlation time is held.
    """
    return tuple(
        problem.axis.dof
        for problem, place in zip(now.joint.problems, now.joint.places, strict=True)
        if problem.axis.dof not in (*now.filtered, *now.doubted, *now.untold)
        and now.theta[place][TIME_CONSTANT] > np.log(LONGEST_S)
    )


def slow_forces(now: Nominal) -> tuple[Slow, ...]:
    """The slow forces in these degrees of freedom."""
    dofs = slow_axes(now)
    pairs = zip(now.joint.at(now.theta), now.joint.places, strict=True)
    return tuple(
        _slow(problem, now.theta[place], now) for problem, place in pairs if problem.axis.dof in dofs
    )


def _slow(problem: AxisLikelihood, theta: Array, now: Nominal) -> Slow:
    free = climb(problem, theta, NEARLY).theta
    mean, precision, start = problem.prior_mean.copy(), problem.prior_precision.copy(), theta.copy()
    mean[TIME_CONSTANT] = start[TIME_CONSTANT] = np.log(LONGEST_S)
    precision[TIME_CONSTANT] = HELD
    held = climb(replace(problem, prior_mean=mean, prior_precision=precision), start, NEARLY).theta
    force = np.interp(now.course.time_s, problem.axis.time_s, problem.means(free)[:, 2])
    if _correlation(force, LONGEST_S / now.course.step_s) < np.exp(-1.0):
        # A smoother sea than of first order is also likelier with a longer correlation time, but it forgets as soon.
        return Slow(problem.axis.dof, force, 0.0)
    return Slow(problem.axis.dof, force, problem.log_likelihood(free) - problem.log_likelihood(held))


def _correlation(values: Array, steps: float) -> float:
    """Correlation of a series (n,) with itself so many steps later; 0 for a constant series."""
    later = min(max(round(steps), 1), len(values) - 2)
    off = values - values.mean()
    return float(off[:-later] @ off[later:] / max(float(off @ off), 1e-300) * len(off) / (len(off) - later))
