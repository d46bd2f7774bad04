"""Why an interval might be wrong: a drag that the model lacks, a controller that used what was not recorded."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from identify.dive import Dive
from identify.estimators.innovations import POSITION
from identify.estimators.likelihood_axis import DAMPING, FORCES, MASS, AxisFit, AxisLikelihood
from identify.estimators.scoring import climb, score

Array = NDArray[np.float64]

DOUBTFUL_SCORE = 5.0
LARGEST_UNEXPLAINED = 0.25
DEAF_NOISE = 1e6
WINDOW_S = 10.0


@dataclass(frozen=True)
class Doubts:
    """What speaks against the fit of one axis.

    drag_score: how many standard errors a quadratic damping is away from none. shift (2,): by how much log mass and
    log damping move once it is let in, 0 where nothing calls for it. hidden: share of the controller's wrench that
    follows from nothing recorded, 0 where that is little.
    """

    drag_score: float
    shift: Array
    hidden: float

    @property
    def lacks_drag(self) -> bool:
        return abs(self.drag_score) > DOUBTFUL_SCORE


def doubts_of(fit: AxisFit, hidden: float | None) -> Doubts:
    """The doubts about a fit; `hidden` from `unexplained_feedback`."""
    wider, start = _with_drag(fit)
    drag_score = _drag_score(fit, wider, start)
    shift = np.zeros(2)
    if abs(drag_score) > DOUBTFUL_SCORE:
        shift = climb(wider, start).theta[[MASS, DAMPING]] - fit.maximum.theta[[MASS, DAMPING]]
    return Doubts(drag_score, shift, hidden if hidden is not None and hidden > LARGEST_UNEXPLAINED else 0.0)


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
