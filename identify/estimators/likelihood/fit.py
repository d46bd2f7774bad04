"""Fits all axes: roughly each alone, then all together, with better velocities in the Coriolis forces at every pass.

An axis's likelihood has several summits: the same motion may be attributed to the readings' noise or to a disturbance,
and mass and damping change with that choice. So the climb begins at several starts.
"""

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from bridge.arrays import Array
from bridge.vehicle.coefficients import DAMPINGS, MASSES, OF_HULL
from bridge.vehicle.config import Configuration
from identify.estimators.axes.axis import Axes, Axis
from identify.estimators.filter.state import POSITION
from identify.estimators.likelihood.axis import DAMPING, DISTURBANCE, FORCES, MASS, AxisFit, AxisLikelihood
from identify.estimators.likelihood.intervals import integrated, knowledge_of, stretches
from identify.estimators.likelihood.joint import ROUGHLY, JointLikelihood, coefficients
from identify.estimators.likelihood.misread_drift import with_misread_drift
from identify.estimators.likelihood.priors import MASS_RATIO, likelihood_of
from identify.estimators.likelihood.scoring import MOST_STEPS, Maximum, climb, log_posterior
from identify.threads import shared, side_by_side

ROWS = len(OF_HULL)

PASSES = 16
"""Largest number of fits; each takes its Coriolis forces from the velocities of the fit before."""

SETTLED = 0.02
"""Passes end when no coefficient moves by more than this share of its standard error."""


@dataclass(frozen=True)
class JointFit:
    """The fits of the axes by degree of freedom, and the joint knowledge of all their coefficients.

    log_value (18,) and covariance (18, 18): the logarithms of `OF_HULL`, with the noise levels integrated out, NaN
    for those that are not fitted. stretch (18, 2): factors on the lower and the upper half of each interval.
    information (3 k, 3 k): information of the dive alone on log mass, log damping and trim force of the k axes, in
    the order of `fits`, all other parameters projected out. stopped_at: the bound at which the search stopped, empty
    if it converged. joint, theta: the likelihood of all axes, and the position of its maximum.
    """

    fits: dict[int, AxisFit]
    log_value: Array
    covariance: Array
    stretch: Array
    information: Array
    stopped_at: str
    joint: JointLikelihood
    theta: Array


@dataclass(frozen=True)
class Begun:
    """The likelihood of all axes with the Coriolis forces of measured velocities, and the approximate position of its
    maximum."""

    joint: JointLikelihood
    maximum: Maximum


def _begin(built: Axes, configuration: Configuration, feedback_unrecorded: tuple[int, ...]) -> Begun:
    """Fit each axis alone, then all roughly together; there is at least one axis."""
    masses = np.array([MASS_RATIO * configuration.rigid_body(dof)[0] for dof in range(6)])
    unmeasured = sorted(set(range(6)) - {axis.dof for axis in built.axes})

    def begun(axis: Axis) -> tuple[AxisLikelihood, Array]:
        loose = sorted(set(range(6)) - {axis.dof}) if axis.dof in feedback_unrecorded else unmeasured
        problem = likelihood_of(axis, configuration, masses, loose, configuration.damping)
        theta = rough_maximum(
            problem, configuration.rigid_body(axis.dof)[0], configuration.model
        ).theta.copy()
        if configuration.damping != "linear":
            # The measured speed contains the readings that it is to explain, so the drag made of it comes out too
            # small.
            problem = problem.slowed(theta)
            theta[problem.quadratic_index] = problem.prior_mean[problem.quadratic_index]
            theta = climb(problem, theta, ROUGHLY).theta
        return problem, theta

    problems, thetas = zip(*side_by_side(begun, built.axes, lambda axis: len(axis.reading)), strict=True)
    joint = _joined(problems, feedback_unrecorded)
    maximum = climb(joint, joint.started(thetas), ROUGHLY)
    misread = with_misread_drift(joint, maximum.theta, built.motion)
    return Begun(misread, maximum if misread is joint else climb(misread, maximum.theta, ROUGHLY))


rough_fit = shared(_begin)
"""`Begun` for axes, configuration and the degrees of freedom with unrecorded feedback, shared by all methods that hold
it."""


def fit_axes(
    built: Axes,
    configuration: Configuration,
    progress: Callable[[float, str], None],
    feedback_unrecorded: Collection[int] = (),
) -> JointFit:
    """Return the joint fit of all axes. Every pass leaves out the readings that the pass before took for spikes.

    The equation of a degree of freedom whose controller used an unrecorded reading (`feedback_unrecorded`) determines
    no mass, neither its own nor those of others that act in it.
    """
    if not built.axes:
        nothing, none = np.full(ROWS, np.nan), np.zeros(0)
        unknown = np.full((ROWS, ROWS), np.nan)
        return JointFit(
            {}, nothing, unknown, np.ones((ROWS, 2)), np.zeros((0, 0)), "", JointLikelihood(()), none
        )
    progress(0.0, "fitting each axis, then all together roughly")
    begun = rough_fit(built, configuration, tuple(sorted(feedback_unrecorded)))
    joint, maximum = begun.value.joint, begun.value.maximum
    settled = False
    for turn in range(PASSES):
        progress(0.3 + 0.7 * turn / PASSES, "fitting all axes together")
        before = maximum.theta
        joint = joint.with_better_forces(built.motion, before)
        joint = joint.with_others_word(before, np.asarray(np.linalg.inv(maximum.precision), np.float64))
        maximum = climb(joint, before)
        std = np.sqrt(np.diag(np.linalg.inv(maximum.precision)))
        moved = np.abs(maximum.theta - before) / std
        kept = coefficients(joint)[1]
        settled = bool(turn and np.max(moved[kept]) < SETTLED)
        if settled:
            break
    return _taken_apart(joint, maximum, stopped_at(maximum, settled))


def stopped_at(maximum: Maximum, settled: bool) -> str:
    """The bound that the search met: of its passes, or of the steps within the last pass; empty if it met none."""
    if not settled:
        return f"{PASSES} passes"
    if maximum.converged:
        return ""
    return f"{MOST_STEPS} steps" if maximum.steps == MOST_STEPS else "a smallest step"


def _joined(problems: Sequence[AxisLikelihood], feedback_unrecorded: Collection[int]) -> JointLikelihood:
    """Return the axes together. The mass of an axis with unrecorded feedback is a parameter of its own, with the prior
    of its own equation."""
    apart = [problem for problem in problems if problem.axis.dof in feedback_unrecorded]
    prior = np.array(
        [(doubtful.prior_mean[MASS], doubtful.prior_precision[MASS]) for doubtful in apart]
    ).reshape(-1, 2)
    return JointLikelihood(tuple(problems), tuple(doubtful.axis.dof for doubtful in apart), prior)


def _taken_apart(joint: JointLikelihood, maximum: Maximum, stopped_at: str) -> JointFit:
    fits = axis_fits(joint, maximum)
    rows, indices = coefficients(joint)
    known = knowledge_of(joint, maximum)
    shift, widening = integrated(joint, maximum.theta)
    shift[list(known.stretch)] = 0.0
    log_value, covariance = np.full(ROWS, np.nan), np.full((ROWS, ROWS), np.nan)
    log_value[rows] = (known.middle + shift)[indices]
    covariance[np.ix_(rows, rows)] = (known.covariance * np.outer(widening, widening))[
        np.ix_(indices, indices)
    ]
    stretch = np.ones((ROWS, 2))
    starts = {
        problem.axis.dof: of_axis.start for problem, of_axis in zip(joint.problems, joint.slices, strict=True)
    }
    for row, at in zip(rows, indices, strict=True):
        dof = row % 6
        if at in known.stretch:
            stretch[row] = known.stretch[at]
        elif row == dof and dof in joint.apart:
            stretch[row] = stretches(joint, maximum.theta, at)
        else:
            stretch[row] = stretches(fits[dof].problem, fits[dof].maximum.theta, at - starts[dof])
    parameters = [
        at
        for of_axis, mass in zip(joint.slices, joint.mass_indices, strict=True)
        for at in (mass, of_axis.start + DAMPING, of_axis.start + FORCES)
    ]
    information = joint.projected(maximum.information, np.array(parameters))
    return JointFit(fits, log_value, covariance, stretch, information, stopped_at, joint, maximum.theta)


def axis_fits(joint: JointLikelihood, maximum: Maximum) -> dict[int, AxisFit]:
    """The fit of each axis by degree of freedom, with the other axes' information on its mass."""
    whole: Array = np.asarray(np.linalg.inv(maximum.precision), dtype=np.float64)
    fits = {}
    for problem, of_axis in zip(joint.at(maximum.theta), joint.slices, strict=True):
        axis_maximum = replace(
            maximum,
            theta=maximum.theta[of_axis],
            information=maximum.information[of_axis, of_axis],
            precision=maximum.precision[of_axis, of_axis],
        )
        fits[problem.axis.dof] = AxisFit(
            _with_others_word(problem, axis_maximum), axis_maximum, whole[of_axis, of_axis]
        )
    return fits


def _with_others_word(problem: AxisLikelihood, maximum: Maximum) -> AxisLikelihood:
    """The axis's likelihood with the other axes' estimate of its mass, chosen so that its maximum, too, lies at
    `own`."""
    gradient, information = problem.score(maximum.theta)
    mass, prior = float(np.exp(maximum.theta[MASS])), problem.prior_precision[MASS]
    precision = max(float(maximum.information[MASS, MASS] - information[MASS, MASS]), 0.0) / mass**2
    if precision == 0.0:
        return problem
    pull = prior * (maximum.theta[MASS] - problem.prior_mean[MASS]) - gradient[MASS]
    return replace(problem, word=(mass + float(pull) / (mass * precision), precision))


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
            maxima.append(climb(problem, theta, enough))
        except np.linalg.LinAlgError:
            continue
    if not maxima:
        raise np.linalg.LinAlgError("no start leads to a maximum")
    return max(maxima, key=lambda each: each.log_likelihood)


def regressed(problem: AxisLikelihood, rigid: float) -> Array:
    """The prior's mean with mass, drag and disturbance from least squares: over each WINDOW_S, the impulse is the
    mass times the change of speed, plus the drag."""
    axis, quadratic = problem.axis, problem.damped != "linear"
    time_s, speed = axis.time_s, axis.speed
    force = axis.force.mean(axis=1) + axis.coriolis @ problem.masses
    placed = (axis.state_read == POSITION) & np.isfinite(axis.reading)
    if axis.stiffness > 0 and placed.any():
        force = force - axis.stiffness * np.interp(time_s, time_s[placed], axis.reading[placed])
    windows = [np.arange(time_s[run][0], time_s[run][-1], WINDOW_S) for run in axis.runs]
    middle, lasts = time_s - 0.5 * axis.step_s, axis.step_s > 0
    ways = [speed, *([speed * np.abs(speed)] if quadratic else []), np.ones_like(speed), force]

    def changed(known_s: Array, values: Array) -> Array:
        return np.concatenate([np.diff(np.interp(edges, known_s, values)) for edges in windows])

    changes = changed(middle[lasts], speed[lasts])
    *drags, impulse = (changed(time_s, np.cumsum(way * axis.step_s)) for way in ways)
    table = np.column_stack([changes, *drags])
    theta = problem.prior_mean.copy()
    if len(impulse) <= table.shape[1] or not np.isfinite(table).all() or not np.isfinite(impulse).all():
        return theta
    fitted, *_ = np.linalg.lstsq(table, impulse, rcond=None)
    left = float(np.std(impulse - table @ fitted)) / WINDOW_S
    theta[MASS] = _within(fitted[0], MASS_REACH, rigid)
    theta[DAMPING] = _within(fitted[1], DAMPING_REACH, rigid)
    if quadratic:
        theta[problem.quadratic_index] = _within(fitted[2], QUADRATIC_REACH, rigid)
    theta[DISTURBANCE] = np.log(max(left, LEAST_DISTURBANCE * rigid))
    return theta


def _within(value: float, reach: tuple[float, float], rigid: float) -> float:
    """The logarithm of a value limited to its bounds."""
    return float(np.log(np.clip(value, reach[0] * rigid, reach[1] * rigid)))


def _of_file(problem: AxisLikelihood, start: Array, model: Mapping[str, float]) -> Array:
    """The start with the vehicle file's own model of the axis."""
    theta = start.copy()
    for index, group in ((MASS, MASSES), (DAMPING, DAMPINGS)):
        value = model.get(group[problem.axis.dof].name, 0.0)
        if value > 0:
            theta[index] = np.log(value)
    return theta
