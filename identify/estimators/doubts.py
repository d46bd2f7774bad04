"""Why an interval might be wrong: a drag that the model lacks, thrust that acts at another time than it says."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from identify.estimators.axes import Axis
from identify.estimators.innovations import POSITION
from identify.estimators.likelihood_axis import DAMPING, FORCES, MASS, AxisFit
from identify.estimators.multiplier import Tested, with_force
from identify.estimators.scoring import climb

Array = NDArray[np.float64]

DOUBTFUL_SCORE = 5.0
DEAF_NOISE = 1e6

LATER_S = 0.03
"""Short beside what moves a vehicle. Only forces that come later are asked: one that came sooner would answer, through
the controller, to noise in readings that were yet to be."""


@dataclass(frozen=True)
class Doubts:
    """What speaks against the fit of one axis.

    drag: of a quadratic damping, N/(m/s)^2 or N m/(rad/s)^2. shift (2,): by how much log mass and log damping move once
    it is let in, 0 where nothing calls for it. late: of seconds by which forces act later than they are taken to.
    """

    drag: Tested
    shift: Array
    late: Tested

    @property
    def by_late(self) -> Array:
        """What log mass and log damping (2,) move by with each second."""
        return np.asarray(self.late.leaning[[MASS, DAMPING]])

    @property
    def lacks_drag(self) -> bool:
        return abs(self.drag.score) > DOUBTFUL_SCORE

    @property
    def is_late(self) -> bool:
        return abs(self.late.score) > DOUBTFUL_SCORE


def doubts_of(fit: AxisFit) -> Doubts:
    """The doubts about a fit."""
    speed = simulated_speed(fit)
    wider = with_force(fit, -speed * np.abs(speed))
    drag, shift = wider.tested(), np.zeros(2)
    if abs(drag.score) > DOUBTFUL_SCORE:
        shift = climb(wider.problem, wider.start).theta[[MASS, DAMPING]] - fit.maximum.theta[[MASS, DAMPING]]
    return Doubts(drag, shift, with_force(fit, by_lateness(fit.problem.axis)).tested())


def by_lateness(axis: Axis) -> Array:
    """What each step's mean force (n,) changes by, per second that the forces come later."""
    moving = axis.step_s > 0
    step_s, end_s = axis.step_s[moving], axis.time_s[moving]
    start_s = end_s - step_s
    knot_s = np.concatenate([start_s[:1], np.column_stack([end_s - 0.5 * step_s, end_s]).ravel()])
    impulse = np.concatenate([[0.0], np.cumsum((0.5 * step_s[:, None] * axis.force[moving]).ravel())])

    def mean(later_s: float) -> Array:
        until, since = (np.interp(time_s - later_s, knot_s, impulse) for time_s in (end_s, start_s))
        return np.asarray((until - since) / step_s)

    out = np.zeros(len(axis.step_s))
    out[moving] = (4 * mean(LATER_S) - 3 * mean(0.0) - mean(2 * LATER_S)) / (2 * LATER_S)
    return out


def simulated_speed(fit: AxisFit) -> Array:
    """Speed (n,) at the events as the model alone gives it from the forces: it shares no noise with the readings."""
    axis = fit.problem.axis
    theta = fit.maximum.theta.copy()
    theta[FORCES + fit.problem.shapes.shape[1] :] = np.log(DEAF_NOISE)
    error, _ = fit.problem.filtered(theta, np.inf)
    moving = np.isfinite(error) & (axis.state_read != POSITION)
    said = ((fit.problem.reading - error) / axis.scale)[moving]
    speed: Array = np.interp(axis.time_s, axis.time_s[moving], said)
    return speed
