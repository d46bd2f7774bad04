"""Slow forces that the disturbance absorbed: one axis forgets far more slowly than the others.

A disturbance of free correlation time follows any force that changes slowly, and its filter's innovations are then as
white as without the force. One sea, however, disturbs all axes with the same correlation time. So each axis's filter
is compared with a filter whose disturbance has the correlation time and the two poles of the other axes, with all else
fitted again. A sea that is smoother than a first-order one is likelier with a longer correlation time, too; only a
disturbance that is still correlated with itself long after that time counts as slow. Roll and pitch do not tell the
sea's memory to the other axes: their motion is mostly their levelling, and behind a simulated ArduSub it seemed to
forget in 0.6 s what the sea held for 1.5 s.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from bridge.arrays import Array
from identify.diagnose.filters.nominal import NEARLY, Nominal
from identify.diagnose.filters.regression import LEVELLED
from identify.estimators.likelihood.axis import TIME_CONSTANT, AxisLikelihood
from identify.estimators.likelihood.priors import SECOND_POLE
from identify.estimators.likelihood.scoring import climb

SLOWER, FORGOTTEN = 1.5, 4.0
"""Longest correlation time of a sea in one axis, relative to the other axes, and the lag, in correlation times, at
which it is forgotten."""

LEAST_CORRELATION, LEAST_SIGMA = 0.3, 4.0
"""Correlation at that lag that no sea has left, and the same in its standard errors."""

FEW, USUAL_S = 2, 4.0
"""With fewer other axes, the sea counts as one of this correlation time, s: a slow one's."""

HELD = 1e6
"""Precision of a logarithm that is held fixed."""


@dataclass(frozen=True)
class Slow:
    """A slow force (n,), N or N m, along a dive's course, in one degree of freedom; gain: nats that it saves."""

    dof: int
    force: Array
    gain: float


@dataclass(frozen=True)
class Sea:
    """The sea that moves the other axes: its correlation time, and the log odds of its evenness."""

    memory_s: float
    evenness: float


def slow_axes(now: Nominal) -> dict[int, Sea]:
    """Degrees of freedom whose disturbance forgets more slowly than a sea's, with the sea of the other axes.

    Left out are those of `feedback_unrecorded` and `force_undetermined`, and those behind an autopilot's filter,
    whose correlation time is held.
    """
    left_out = {*now.filtered, *now.feedback_unrecorded, *now.force_undetermined}
    # These do not tell the sea's memory either: behind a filter it is held, not found.
    seas = {
        problem.axis.dof: Sea(float(np.exp(now.theta[of_axis][TIME_CONSTANT])), float(now.theta[of_axis][-1]))
        for problem, of_axis in zip(now.joint.problems, now.joint.slices, strict=True)
        if problem.axis.dof not in left_out
    }
    others = {
        dof: _median([sea for k, sea in seas.items() if k != dof and k not in LEVELLED]) for dof in seas
    }
    return {
        problem.axis.dof: sea
        for problem, of_axis in zip(now.joint.at(now.theta), now.joint.slices, strict=True)
        if problem.axis.dof in seas
        and seas[problem.axis.dof].memory_s > SLOWER * (sea := others[problem.axis.dof]).memory_s
        and not _forgets(_disturbance(problem, now.theta[of_axis], now), sea.memory_s, now)
    }


def _median(seas: Sequence[Sea]) -> Sea:
    if len(seas) < FEW:
        return Sea(USUAL_S, SECOND_POLE)
    return Sea(
        float(np.median([sea.memory_s for sea in seas])), float(np.median([sea.evenness for sea in seas]))
    )


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
    seas = slow_axes(now)
    return tuple(
        _slow(problem, now.theta[of_axis], now, seas[problem.axis.dof])
        for problem, of_axis in zip(now.joint.at(now.theta), now.joint.slices, strict=True)
        if problem.axis.dof in seas
    )


def _slow(problem: AxisLikelihood, theta: Array, now: Nominal, sea: Sea) -> Slow:
    free = climb(problem, theta, NEARLY).theta
    mean, precision, start = problem.prior_mean.copy(), problem.prior_precision.copy(), theta.copy()
    memory = [TIME_CONSTANT, -1]
    mean[memory] = start[memory] = np.log(SLOWER * sea.memory_s), sea.evenness
    precision[memory] = HELD
    held = climb(replace(problem, prior_mean=mean, prior_precision=precision), start, NEARLY).theta
    gain = problem.log_likelihood(free) - problem.log_likelihood(held)
    return Slow(problem.axis.dof, _disturbance(problem, free, now), gain)


def _correlation(values: Array, steps: float) -> float:
    """Correlation of a series (n,) with itself so many steps later; 0 for a constant series."""
    later = min(max(round(steps), 1), len(values) - 2)
    off = values - values.mean()
    return float(off[:-later] @ off[later:] / max(float(off @ off), 1e-300) * len(off) / (len(off) - later))
