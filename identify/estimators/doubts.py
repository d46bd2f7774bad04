"""Why an interval might be wrong: a drag that the model lacks, a controller that used what was not recorded."""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from identify.dive import Dive
from identify.estimators.innovations import POSITION
from identify.estimators.likelihood_axis import FORCES, AxisFit
from identify.estimators.scoring import score

Array = NDArray[np.float64]

DOUBTFUL_SCORE = 5.0
LARGEST_UNEXPLAINED = 0.25
DEAF_NOISE = 1e6
WINDOW_S = 10.0


def quadratic_score(fit: AxisFit) -> float:
    """How many standard errors a quadratic damping is away from none, without fitting it.

    The Lagrange-multiplier test (Engle 1984, eq. 13): the gradient of the likelihood with respect to the new
    coefficient at zero, over the root of its information with the fitted parameters projected out. Positive
    for drag.
    """
    problem, theta = fit.problem, fit.maximum.theta
    speed = simulated_speed(fit)
    shape = -speed * np.abs(speed)
    size = float(np.sqrt(np.mean(shape**2)))
    if size == 0.0:
        return 0.0
    place = FORCES + problem.shapes.shape[1]
    wider = replace(
        problem,
        shapes=np.column_stack([problem.shapes, shape]),
        prior_mean=np.insert(problem.prior_mean, place, 0.0),
        prior_precision=np.insert(problem.prior_precision, place, 0.0),
        difference=np.insert(problem.difference, place, 1e-3 / size),
    )
    gradient, information = score(wider, np.insert(theta, place, 0.0))
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


def unexplained_feedback(dive: Dive, dof: int, depth: Array | None) -> float | None:
    """Share of the feedback controller's recorded wrench that no recorded reading explains; None where unknown.

    A linear controller's wrench is a combination of the velocity that it used, its reference, the error's
    integral and, in heave, depth. What is left over came from a signal that the recording lacks; through it the
    disturbance steers the thrust unseen, and a likelihood takes that for mass. The median over short windows, so
    that gains which are scheduled slowly do not count. `depth` (n,) m at the times of TAU_PID.
    """
    tau, used, reference = dive.tau_pid, dive.nu_fb, dive.nu_ref
    if tau is None or used is None or reference is None or len(tau) < 2:
        return None
    wanted = tau.value[:, dof]
    nu, target = used.held_at(tau.time_s)[:, dof], reference.held_at(tau.time_s)
    step_s = np.diff(tau.time_s, prepend=tau.time_s[0])
    errors = [target[:, dof] - nu]
    if dof == 2 and depth is not None:
        errors.append(target[:, 13] - depth)
    columns = [nu, target[:, dof], target[:, 6 + dof], np.ones(len(wanted))]
    columns += [e for error in errors for e in (error, np.cumsum(np.nan_to_num(error) * step_s))]
    table = np.column_stack([*columns, wanted])
    window = round(WINDOW_S * tau.rate_hz)
    shares = [_left_over(table[i : i + window]) for i in range(0, len(table) - window + 1, window)]
    known = [share for share in shares if share is not None]
    return float(np.median(known)) if known else None


def _left_over(table: Array) -> float | None:
    """Share of the last column that no combination of the others gives; None where it stands still."""
    table = table[np.isfinite(table).all(axis=1)]
    if len(table) < 4 * table.shape[1] or np.std(table[:, -1]) < 1e-9:
        return None
    fitted, *_ = np.linalg.lstsq(table[:, :-1], table[:, -1], rcond=None)
    return float(np.std(table[:, -1] - table[:, :-1] @ fitted) / np.std(table[:, -1]))
