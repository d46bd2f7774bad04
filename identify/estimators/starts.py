"""Start of the climb of one axis. Its likelihood has several summits: the same motion may be attributed to the
readings' noise or to a disturbance, and mass and damping change with that choice."""

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from bridge.vehicle.coefficients import DAMPINGS, MASSES
from identify.estimators.innovations import POSITION
from identify.estimators.likelihood_axis import DAMPING, DISTURBANCE, MASS, AxisLikelihood
from identify.estimators.likelihood_joint import ROUGHLY, alone
from identify.estimators.scoring import Maximum, climb, log_posterior

Array = NDArray[np.float64]

WINDOW_S = 1.0
"""Window over which impulses are summed: no reading is differentiated."""

MASS_REACH, DAMPING_REACH, QUADRATIC_REACH = (0.3, 10.0), (0.02, 50.0), (0.1, 100.0)
"""Bounds on a plain regression as a start value, in units of the rigid body's mass (per s, per m)."""

LEAST_DISTURBANCE = 1e-3
"""As a share of the rigid body's mass, N per kg."""


def rough_maximum(
    problem: AxisLikelihood, rigid: float, model: Mapping[str, float], enough: float = ROUGHLY
) -> Maximum:
    """Return the more likely end of two climbs: from the prior's mean, and from plain regression or the file's
    `model`, whichever is more likely at the start. `rigid`: the rigid body's mass or inertia.

    Raises LinAlgError if no climb reaches a maximum.
    """
    plain = regressed(problem, rigid)
    known = _of_file(problem, plain, model)
    nearer = max((plain, known), key=lambda theta: log_posterior(problem, theta))
    maxima: list[Maximum] = []
    for theta in (problem.prior_mean, nearer):
        try:
            maxima.append(climb(problem, theta, enough, alone))
        except np.linalg.LinAlgError:
            continue
    if not maxima:
        raise np.linalg.LinAlgError("no start leads to a maximum")
    return max(maxima, key=lambda one: one.log_likelihood)


def regressed(problem: AxisLikelihood, rigid: float) -> Array:
    """The prior's mean with mass, drag and disturbance from least squares: over each WINDOW_S, the impulse is the
    mass times the change of speed, plus the drag."""
    axis, quadratic = problem.axis, problem.damped != "linear"
    time_s, speed = axis.time_s, axis.speed
    force = axis.force.mean(axis=1) + axis.coriolis @ problem.masses
    placed = (axis.state_read == POSITION) & np.isfinite(axis.reading)
    if axis.stiffness > 0 and placed.any():
        force = force - axis.stiffness * np.interp(time_s, time_s[placed], axis.reading[placed])
    edges = np.arange(time_s[0], time_s[-1], WINDOW_S)
    middle, lasts = time_s - 0.5 * axis.step_s, axis.step_s > 0
    changes = np.diff(np.interp(edges, middle[lasts], speed[lasts]))
    ways = [speed, *([speed * np.abs(speed)] if quadratic else []), np.ones_like(speed), force]
    *drags, impulse = (np.diff(np.interp(edges, time_s, np.cumsum(way * axis.step_s))) for way in ways)
    table = np.column_stack([changes, *drags])
    theta = problem.prior_mean.copy()
    if len(impulse) <= table.shape[1] or not np.isfinite(table).all() or not np.isfinite(impulse).all():
        return theta
    fitted, *_ = np.linalg.lstsq(table, impulse, rcond=None)
    left = float(np.std(impulse - table @ fitted)) / WINDOW_S
    theta[MASS] = _within(fitted[0], MASS_REACH, rigid)
    theta[DAMPING] = _within(fitted[1], DAMPING_REACH, rigid)
    if quadratic:
        theta[problem.quadratic_place] = _within(fitted[2], QUADRATIC_REACH, rigid)
    theta[DISTURBANCE] = np.log(max(left, LEAST_DISTURBANCE * rigid))
    return theta


def _within(value: float, reach: tuple[float, float], rigid: float) -> float:
    """The logarithm of a value limited to its bounds."""
    return float(np.log(np.clip(value, reach[0] * rigid, reach[1] * rigid)))


def _of_file(problem: AxisLikelihood, start: Array, model: Mapping[str, float]) -> Array:
    """The start with the vehicle file's own model of the axis."""
    theta = start.copy()
    for place, group in ((MASS, MASSES), (DAMPING, DAMPINGS)):
        value = model.get(group[problem.axis.dof].name, 0.0)
        if value > 0:
            theta[place] = np.log(value)
    return theta
