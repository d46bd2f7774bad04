"""The nominal model fitted to a dive: filters at its maximum likelihood, less the effects accepted so far.

Before the fit, fast readings are thinned: a gap shows within tenths of a second, and every candidate costs time per
reading.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from bridge.arrays import Array
from bridge.errors import FitError
from bridge.vehicle.coefficients import (
    DAMPINGS,
    HEAVE,
    MASSES,
    PITCH,
    QUADRATICS,
    ROLL,
    SURGE,
    SWAY,
    YAW,
)
from bridge.vehicle.config import VehicleFile
from identify.checks.actuation.controller import unrecorded
from identify.checks.actuation.thrust_response import mirrored, swapped
from identify.diagnose.causes.candidates import Cause
from identify.diagnose.filters.innovations import early_half, mean_before, means_before, reading_error
from identify.diagnose.filters.judged_axes import axes_of, without_quick
from identify.diagnose.filters.predicted import by_present_thrust, course_of, predicted
from identify.diagnose.filters.regression import steady_trims
from identify.diagnose.filters.slow_samples import is_delayed, late_samples_s, with_later_commands
from identify.diagnose.filters.witnesses import Witness, witnesses
from identify.dive import STAMPED_S, Dive
from identify.effects.course import Course
from identify.effects.effect import Act
from identify.estimators.axes.axis import Axes, Axis
from identify.estimators.axes.motion import Motion
from identify.estimators.filter.state import POSITION
from identify.estimators.likelihood.axis import DAMPING, MASS, TIME_CONSTANT, AxisLikelihood
from identify.estimators.likelihood.joint import ROUGHLY, JointLikelihood
from identify.estimators.likelihood.scoring import climb
from identify.estimators.likelihood.spikes import GATE_SIGMA
from identify.estimators.likelihood.start import start_of
from identify.estimators.timing.autopilot_velocity import dated, dated_back
from identify.estimators.timing.lateness import behind_filter
from identify.threads import both, side_by_side

NEARLY = 0.05
"""Tolerance of the joint maximum likelihood, nats."""

PASSES = 2

NOWHERE, NEVER_SIGMA = 1e15, 1e6
"""A reading beyond a gate of so many standard deviations, which every real reading passes."""

SEA_S, SEA_SPREAD = 1.5, 0.1
"""Correlation time of a sea's disturbance, s, and the prior spread of its logarithm."""

SPREAD_BETWEEN_AXES = 0.2
"""Prior spread between surge and sway of the logarithm of an autopilot filter's error."""


@dataclass(frozen=True)
class Nominal:
    """A dive's filters at the maximum likelihood of the nominal model.

    built, joint: the identification's axes and likelihood, less the contribution of `acts`. theta (p,): the maximum,
    with no steady push. log_posterior: at the maximum; a reading that is left out counts as one at GATE_SIGMA. motion:
    velocities for the Coriolis forces. course: inputs of the effects. feedback_unrecorded: degrees of freedom whose
    controller used an unrecorded reading. filtered: degrees of freedom whose outliers an autopilot's filter has
    already removed; timing_s: lateness and smoothing of that filter's velocity, None without it; late_thrust_s: delay
    and lag of the thrust beyond the vehicle file's, as known when the velocity was dated; late_samples_s: delay of
    slow samples of commands, which the forces include; stamped_s: as in `Dive`. witnesses: further sensors that show
    effects. accepted: earlier effects, removed from forces, readings and witnesses. mirrored: degrees of freedom that
    run against their thrust; swapped: pairs that follow each other's thrust.
    """

    built: Axes
    joint: JointLikelihood
    theta: Array
    log_posterior: float
    motion: Motion
    course: Course
    feedback_unrecorded: tuple[int, ...]
    filtered: tuple[int, ...] = ()
    witnesses: tuple[Witness, ...] = ()
    acts: tuple[Act, ...] = ()
    accepted: tuple[Cause, ...] = ()
    mirrored: tuple[int, ...] = ()
    swapped: tuple[tuple[int, int], ...] = ()
    timing_s: tuple[float, float] | None = None
    late_thrust_s: tuple[float, float] = (0.0, 0.0)
    late_samples_s: float = 0.0
    stamped_s: float = STAMPED_S

    @property
    def feedback_maybe_unrecorded(self) -> tuple[int, ...]:
        """Degrees of freedom in which a controller may have acted on a reading that the recording lacks.

        They are those of `feedback_unrecorded`, and heave behind an autopilot's filter or known by depth alone, because
        the climb rate that holds the depth is not recorded.
        """
        return tuple(sorted({*self.feedback_unrecorded, *({HEAVE} & {*self.filtered}), *self._by_depth}))

    @property
    def inexact(self) -> tuple[int, ...]:
        """Degrees of freedom behind an autopilot's filter, and those whose force is unknown between slow samples."""
        sampled = {axis.dof for axis in self.built.axes if axis.sampled_s}
        return tuple(sorted({*self.filtered, *sampled}))

    @property
    def by_estimated_angle(self) -> tuple[int, ...]:
        """Degrees of freedom of which an angle that the vehicle estimates is among the readings."""
        turning = (axis for axis in self.built.axes if axis.dof >= ROLL)
        return tuple(axis.dof for axis in turning if (axis.state_read == POSITION).any())

    @property
    def force_undetermined(self) -> tuple[int, ...]:
        """Degrees of freedom in which an unknown force can't be separated from an unrecorded reading."""
        return tuple(sorted({*self.velocity_unread, *self.feedback_suspected}))

    @property
    def velocity_unread(self) -> tuple[int, ...]:
        """Degrees of freedom moved by a velocity that was not read.

        Heave is known by depth alone, while the controller knows the climb rate. Roll, pitch and yaw if the thrusters
        pushed in surge or sway and no velocity was read there, because a drifting hull is turned (Munk 1924).
        """
        fitted = {problem.axis.dof for problem in self.joint.problems}
        unseen = {SURGE, SWAY} - fitted - {*self.built.unpushed}
        turned = fitted & {ROLL, PITCH, YAW} if unseen else set()
        return tuple(sorted({*turned, *self._by_depth}))

    @property
    def feedback_suspected(self) -> tuple[int, ...]:
        """The others of surge, sway and heave, if surge or sway is in `feedback_unrecorded`: a controller that used an
        unrecorded reading in one of them may have used it in the others."""
        if not {SURGE, SWAY} & {*self.feedback_unrecorded}:
            return ()
        fitted = {problem.axis.dof for problem in self.joint.problems}
        return tuple(
            sorted({SURGE, SWAY, HEAVE} & fitted - {*self.feedback_unrecorded} - {*self.velocity_unread})
        )

    @property
    def _by_depth(self) -> set[int]:
        """Heave if its only reading is depth."""
        read = {
            problem.axis.dof
            for problem in self.joint.problems
            if problem.axis.channels[0].state_read == POSITION
        }
        return read & {HEAVE}


def nominal_of(
    dive: Dive, file: VehicleFile, configuration_name: str, timing_s: tuple[float, float] | None = None
) -> Nominal:
    """Fit the nominal model alone to a dive; `timing_s`: of an autopilot's velocity, if another dive has shown it.

    Raises FitError for a recording without a usable axis.
    """
    if timing_s and dive.velocity_is_filtered:
        dive = dated_back(dive, *timing_s)
    else:
        dive = dated(dive, file, configuration_name)
    built = axes_of(dive, file, configuration_name)
    if not built.axes:
        why = "; ".join(dict.fromkeys(built.missing.values()))
        raise FitError(
            f"there is nothing to compare with a model ({why}); record velocity and thruster commands",
            of=dive.name,
        )
    configuration = file.vehicle.configurations[configuration_name]
    runs_against, crossed = mirrored(built.axes), swapped(built.axes)
    start, unrecorded_axes = both(
        lambda: start_of(built, configuration), lambda: unrecorded(dive, file.vehicle.water)
    )
    late_s = late_samples_s(start)
    if is_delayed(late_s, dive, start):
        late_s = 0.0
    if late_s:
        dive = with_later_commands(dive, late_s)
        built = axes_of(dive, file, configuration_name)
        start = start_of(built, configuration)
    if (slow := without_quick(start, built, configuration)) is not built:
        start, built = start_of(slow, configuration), slow
    filtered = (0, 1, 2) if dive.velocity_is_filtered else ()
    problems = tuple(
        replace(each, reading=each.axis.reading) if each.axis.dof in filtered else each
        for each in start.joint.problems
    )
    if filtered:
        problems = tuple(_bounded(problem) for problem in problems)
    joint, theta, log_posterior = _maximised(
        replace(start.joint, problems=problems), start.theta, built.motion, filtered
    )
    motion = _smoothed(joint, theta, built.motion)
    mass, damping = coefficients(joint, theta)
    course = course_of(dive, file, configuration_name, predicted(joint, theta, motion), mass, damping)
    course = replace(_known_course(course, joint, theta, ()), drift=motion.nu[:, :3])
    if len(joint.runs_s) > 1:
        course = replace(course, runs_s=joint.runs_s)
    seen = witnesses(dive, file, course)
    return Nominal(
        built,
        joint,
        _without_trims(joint, theta),
        log_posterior,
        motion,
        course,
        tuple(each.dof for each in unrecorded_axes),
        filtered,
        seen,
        mirrored=runs_against,
        swapped=crossed,
        timing_s=(dive.velocity_late_s, dive.velocity_smoothing_s) if filtered else None,
        late_thrust_s=(dive.thrust_delay_s, dive.thrust_lag_s),
        late_samples_s=late_s,
        stamped_s=dive.stamped_s,
    )


def _bounded(problem: AxisLikelihood) -> AxisLikelihood:
    """Limit the disturbance's correlation time to a sea's.

    A slower disturbance would absorb the effect of causes, and a model without them would seem complete.
    """
    mean, precision = problem.prior_mean.copy(), problem.prior_precision.copy()
    mean[TIME_CONSTANT], precision[TIME_CONSTANT] = np.log(SEA_S), SEA_SPREAD**-2.0
    return replace(problem, prior_mean=mean, prior_precision=precision)


def refitted(nominal: Nominal, acts: Sequence[Act], near: Nominal | None = None) -> Nominal:
    """The same dive less the acts' forces and reading errors, with parameters and noise levels fitted again.

    The fit starts from `near`, a fit of `nominal` less other acts, if given.
    """
    beyond = _beyond(acts, nominal.course) - _beyond(near.acts if near else (), nominal.course)
    near = near or nominal
    pairs = zip(nominal.joint.problems, near.joint.problems, strict=True)
    problems = tuple(
        side_by_side(lambda pair: _without_acts(pair[0], acts, nominal.course, pair[1].axis, beyond), pairs)
    )
    joint = replace(nominal.joint, problems=problems)
    joint, theta, log_posterior = _maximised(joint, near.theta, nominal.motion, nominal.filtered, passes=1)
    mass, damping = coefficients(joint, theta)
    motion = _smoothed(joint, theta, nominal.motion)
    at = predicted(joint, theta, motion)
    course = replace(nominal.course, nu=at.nu, nu_dot=at.nu_dot, mass=mass, damping=damping)
    course = replace(_known_course(course, joint, theta, acts), drift=motion.nu[:, :3])
    theta = _without_trims(joint, theta)
    acts = tuple(_braking(act, course) for act in acts)
    return replace(
        nominal,
        joint=joint,
        theta=theta,
        log_posterior=log_posterior,
        motion=motion,
        course=course,
        acts=acts,
    )


def _braking(act: Act, course: Course) -> Act:
    """A quadratic drag along a course: the filters brake by their own speeds, not by the speeds from which it was
    computed."""
    if act.quadratic is None:
        return act
    return replace(act, wrench=-act.quadratic * np.abs(course.nu) * course.nu)


def _without_trims(joint: JointLikelihood, theta: Array) -> Array:
    """Theta without steady pushes, which are fitted only so that the disturbance need not absorb them.

    They are not part of the nominal model.
    """
    out = theta.copy()
    out[steady_trims(joint)] = 0.0
    return out


def _maximised(
    joint: JointLikelihood, theta: Array, motion: Motion, filtered: tuple[int, ...], passes: int = PASSES
) -> tuple[JointLikelihood, Array, float]:
    """Maximise the likelihood, with Coriolis forces of ever better velocities; also returns the log posterior there.

    Outliers are dropped, except in `filtered` degrees of freedom, where a large residual is due to the model.
    """
    for _ in range(passes):
        theta = climb(joint, theta, ROUGHLY).theta
        joint, theta = _alike(joint, theta, filtered)
        better = joint.with_better_forces(motion, theta)
        problems = tuple(
            replace(new, reading=old.reading) if new.axis.dof in filtered else new
            for new, old in zip(better.problems, joint.problems, strict=True)
        )
        joint = replace(better, problems=problems)
    maximum = climb(joint, theta, NEARLY)
    return joint, maximum.theta, maximum.log_likelihood + _log_likelihood_of_dropped(joint, maximum.theta)


def _log_likelihood_of_dropped(joint: JointLikelihood, theta: Array) -> float:
    """Log likelihood of the readings that were dropped, each as of a reading just at the gate: two fits that drop
    different ones can be compared."""
    out = 0.0
    for problem, of_axis in zip(joint.at(theta), joint.slices, strict=True):
        dropped = np.isfinite(problem.axis.reading) & ~np.isfinite(problem.reading)
        if dropped.any():
            # Readings that no filter takes, so that it says how well each was foretold.
            whole = replace(problem, reading=np.where(dropped, NOWHERE, problem.reading))
            _, variance = whole.filtered(theta[of_axis], NEVER_SIGMA)
            out -= 0.5 * float(np.sum(GATE_SIGMA**2 + np.log(variance[dropped])))
    return out


def _alike(joint: JointLikelihood, theta: Array, filtered: Sequence[int]) -> tuple[JointLikelihood, Array]:
    """Make an autopilot filter's error about equal in surge and sway.

    If a model lacks a force in one of them, reading errors would make up for it.
    """
    coloured = [
        (k, of_axis.start + problem.coloured_index)
        for k, (problem, of_axis) in enumerate(zip(joint.problems, joint.slices, strict=True))
        if problem.axis.dof in {SURGE, SWAY} & {*filtered} and problem.axis.is_coloured
    ]
    if len(coloured) < 2:
        return joint, theta
    problems, theta = list(joint.problems), theta.copy()
    _, quietest = min(coloured, key=lambda each: float(theta[each[1]]))
    for k, index in coloured:
        mean, precision = problems[k].prior_mean.copy(), problems[k].prior_precision.copy()
        level = problems[k].coloured_index
        mean[level], precision[level] = theta[quietest], SPREAD_BETWEEN_AXES**-2.0
        problems[k] = replace(problems[k], prior_mean=mean, prior_precision=precision)
        theta[index] = theta[quietest]
    return replace(joint, problems=tuple(problems)), theta


def _beyond(acts: Sequence[Act], course: Course) -> Array:
    """Excess of the velocity readings over the velocity through the water by all acts, (n, 3)."""
    return sum((act.beyond for act in acts if act.beyond is not None), np.zeros((len(course.nu), 3)))


def _without_acts(
    problem: AxisLikelihood, acts: Sequence[Act], course: Course, near: Axis, beyond: Array
) -> AxisLikelihood:
    """An axis less the acts, at the speeds of a nearby fit less the excess `beyond` (n, 3) of its readings.

    A fit moves its speeds half of the way alone: drag at the speed over ground would be drag of another speed.
    """
    axis = problem.axis
    before = axis.before_s

    def faster(late_s: float) -> Array:
        if axis.dof > 2:
            return np.zeros(len(before))
        return mean_before(course.time_s, beyond[:, axis.dof], before - late_s, axis.time_s - late_s)

    force, reading, quadratic = axis.force.copy(), problem.reading.copy(), axis.quadratic
    for act in acts:
        if act.quadratic is not None:
            # The filter itself brakes: a velocity computed beforehand would be off.
            quadratic += float(act.quadratic[axis.dof])
        elif act.wrench is not None:
            delayed_force = behind_filter(act.wrench[:, [axis.dof]], course.step_s, axis.smoothing_s)
            means = means_before(course.time_s, delayed_force, before, axis.time_s)
            early = early_half(means, course.time_s, delayed_force, before, axis.time_s)
            force += np.column_stack([early, 2.0 * means - early])
        off = reading_error(problem, act, course)
        if off is not None:
            reading -= off
    axis = replace(
        axis,
        force=force,
        quadratic=quadratic,
        speed=near.speed - faster(axis.smoothing_s),
        before_filter=near.before_filter - faster(0.0),
        coriolis=near.coriolis,
    )
    return replace(problem, reading=reading).with_axis(axis)


def _smoothed(joint: JointLikelihood, theta: Array, motion: Motion) -> Motion:
    nu, problems = motion.nu.copy(), joint.at(theta)

    def along(k: int) -> None:
        axis, speed = problems[k].axis, problems[k].speed(theta[joint.slices[k]])
        nu[:, axis.dof] = motion.interpolated(axis.shown_s, speed)

    side_by_side(along, range(len(problems)))
    return replace(motion, nu=nu)


def quadratic_of(joint: JointLikelihood, theta: Array) -> Array:
    """Quadratic dampings (6,) that are fitted with the filters."""
    out = np.zeros(6)
    for problem, of_axis in zip(joint.problems, joint.slices, strict=True):
        out[problem.axis.dof] = problem.quadratic(theta[of_axis])
    return out


def _known_course(course: Course, joint: JointLikelihood, theta: Array, acts: Sequence[Act]) -> Course:
    """The course with quadratic drag, water, accelerations by the thrust of each instant, and the motion before an
    autopilot's smoothing, by the filters and the acts."""
    quadratic = quadratic_of(joint, theta)
    for problem in joint.problems:
        quadratic[problem.axis.dof] += problem.axis.quadratic
    moving = [water for water in (course.water, *(act.water for act in acts)) if water is not None]
    course = replace(course, quadratic=quadratic, water=np.asarray(sum(moving)) if moving else None)
    return _unsmoothed(by_present_thrust(course, joint), joint)


def _unsmoothed(course: Course, joint: JointLikelihood) -> Course:
    """The course with velocity and acceleration before an autopilot's filter: nu + T nu_dot of the filtered velocity.

    Thrust changes nu_dot quickly, so the thrust ahead of the filter's lag gives the fast part of the acceleration.
    """
    nu, nu_dot = course.nu.copy(order="F"), course.nu_dot.copy(order="F")
    for axis in (problem.axis for problem in joint.problems):
        if axis.smoothing_s > 0:
            dof, mass = axis.dof, course.mass[axis.dof]
            pushed = course.wrench_of(course.thrust_n)[:, [dof]]
            ahead = (pushed - behind_filter(pushed, course.step_s, axis.smoothing_s))[:, 0]
            slope = course.damping[dof] + 2.0 * course.quadratic[dof] * np.abs(course.nu[:, dof])
            nu[:, dof] += axis.smoothing_s * course.nu_dot[:, dof]
            nu_dot[:, dof] += (ahead - axis.smoothing_s * slope * course.nu_dot[:, dof]) / mass
    return replace(course, nu=nu, nu_dot=nu_dot)


def coefficients(joint: JointLikelihood, theta: Array) -> tuple[Array, Array]:
    """Total masses and linear dampings (6,); 0 damping for an axis that is not fitted."""
    damping = np.zeros(6)
    for problem, of_axis in zip(joint.problems, joint.slices, strict=True):
        damping[problem.axis.dof] = np.exp(theta[of_axis.start + DAMPING])
    return joint.at(theta)[0].masses, damping


def hull_indices(problem: AxisLikelihood) -> dict[str, int]:
    """Indices of an axis's mass and drags in its part of theta, by the coefficients' names."""
    dof = problem.axis.dof
    out = {MASSES[dof].name: MASS}
    if problem.damped != "quadratic":
        out[DAMPINGS[dof].name] = DAMPING
    if problem.damped != "linear":
        out[QUADRATICS[dof].name] = problem.quadratic_index
    return out
