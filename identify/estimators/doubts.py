"""Why an interval might be wrong: a drag that the model lacks."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from identify.estimators.innovations import POSITION
from identify.estimators.likelihood_axis import DAMPING, FORCES, MASS, AxisFit, AxisLikelihood
from identify.estimators.scoring import climb, score

Array = NDArray[np.float64]

DOUBTFUL_SCORE = 5.0
DEAF_NOISE = 1e6


@dataclass(frozen=True)
class Doubts:
    """What speaks against the fit of one axis.

    drag_score: how many standard errors a quadratic damping is away from none. shift (2,): by how much log mass and
    log damping move once it is let in, 0 where nothing calls for it.
    """

    drag_score: float
    shift: Array

    @property
    def lacks_drag(self) -> bool:
        return abs(self.drag_score) > DOUBTFUL_SCORE


def doubts_of(fit: AxisFit) -> Doubts:
    """The doubts about a fit."""
    wider, start = _with_drag(fit)
    drag_score = _drag_score(fit, wider, start)
    shift = np.zeros(2)
    if abs(drag_score) > DOUBTFUL_SCORE:
        shift = climb(wider, start).theta[[MASS, DAMPING]] - fit.maximum.theta[[MASS, DAMPING]]
    return Doubts(drag_score, shift)


def _with_drag(fit: AxisFit) -> tuple[AxisLikelihood, Array]:
    """The likelihood with a quadratic damping beside all else, and the maximum without it."""
    problem = fit.problem
    speed = simulated_speed(fit)
    shape = -speed * np.abs(speed)
    size = max(float(np.sqrt(np.mean(shape**2))), 1e-9)
    place = _place_of_drag(fit)
    wider = replace(
        problem,
        shapes=np.column_stack([problem.shapes, shape]),
        prior_mean=np.insert(problem.prior_mean, place, 0.0),
        prior_precision=np.insert(problem.prior_precision, place, 0.0),
        difference=np.insert(problem.difference, place, 1e-3 / size),
    )
    return wider, np.insert(fit.maximum.theta, place, 0.0)


def _place_of_drag(fit: AxisFit) -> int:
    return FORCES + int(fit.problem.shapes.shape[1])


def _drag_score(fit: AxisFit, wider: AxisLikelihood, start: Array) -> float:
    """The Lagrange-multiplier test (Engle 1984, eq. 13), which fits nothing.

    The gradient of the likelihood with respect to the new coefficient at zero, over the root of its information
    with the fitted parameters projected out. Positive for drag.
    """
    place = _place_of_drag(fit)
    gradient, information = score(wider, start)
    information = information + np.diag(wider.prior_precision)
    others = np.arange(len(gradient)) != place
    cross = information[place, others]
    left = information[place, place] - cross @ np.linalg.solve(information[np.ix_(others, others)], cross)
    return float(gradient[place] / np.sqrt(left)) if left > 0 else 0.0


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
