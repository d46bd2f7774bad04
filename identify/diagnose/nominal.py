"""The nominal model fitted to a dive, with what is accepted so far taken out of its forces and readings."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from bridge.effects.course import Course
from bridge.effects.effect import Act
from bridge.errors import FitError
from bridge.vehicle.config import VehicleFile
from identify.diagnose.causal import expected, mean_before
from identify.diagnose.course import course_of
from identify.diagnose.thinned import thinned
from identify.diagnose.whitened import spoilt
from identify.diagnose.witness import Witness, witnesses
from identify.dive import Dive
from identify.estimators.axes import Axes, build_axes
from identify.estimators.likelihood_axis import DAMPING, AxisLikelihood
from identify.estimators.likelihood_joint import JointLikelihood
from identify.estimators.motion import Motion
from identify.estimators.pinn.start import filters_of
from identify.estimators.scoring import climb
from identify.feedback import unrecorded

Array = NDArray[np.float64]

NEARLY = 0.05
"""Nats: as far as all axes together are climbed."""

PASSES = 2


@dataclass(frozen=True)
class Nominal:
    """A dive's filters at the best parameters of the nominal model.

    built, joint: as the identification has them, without what `acts` add. theta (p,): the maximum. motion: velocities
    that Coriolis forces are made of. course: what effects depend on. doubted: degrees of freedom whose controller used
    a reading that was not recorded. witnesses: what else tells of effects.
    """

    built: Axes
    joint: JointLikelihood
    theta: Array
    motion: Motion
    course: Course
    doubted: tuple[int, ...]
    witnesses: tuple[Witness, ...] = ()
    acts: tuple[Act, ...] = ()


def nominal_of(dive: Dive, file: VehicleFile, configuration: str) -> Nominal:
    """The nominal model alone, fitted to a dive.

    Raises FitError where the recording moves no axis that could be looked at.
    """
    built = build_axes(thinned(dive), file, configuration)
    if not built.axes:
        raise FitError(
            f"{dive.name}: there is nothing to compare with a model ({'; '.join(built.missing.values())}); record "
            "velocity and thruster commands"
        )
    shape = file.vehicle.configurations[configuration]
    start = filters_of(built, shape)
    joint, theta = _climbed(start.joint, start.theta, built.motion)
    doubted = tuple(one.dof for one in unrecorded(dive, file.vehicle.water))
    motion = _smoothed(joint, theta, built.motion)
    mass, damping = _coefficients(joint, theta)
    course = course_of(dive, file, configuration, expected(joint, theta, motion), mass, damping)
    seen = witnesses(dive, file, course)
    return Nominal(built, joint, theta, motion, course, doubted, seen)


def refitted(nominal: Nominal, acts: Sequence[Act]) -> Nominal:
    """The same dive less what the acts add to forces and readings, its parameters and noise levels found anew."""
    problems = tuple(_without(problem, acts, nominal.course) for problem in nominal.joint.problems)
    joint = replace(nominal.joint, problems=problems)
    joint, theta = _climbed(joint, nominal.theta, nominal.motion)
    mass, damping = _coefficients(joint, theta)
    motion = _smoothed(joint, theta, nominal.motion)
    at = expected(joint, theta, motion)
    course = replace(nominal.course, nu=at.nu, nu_dot=at.nu_dot, mass=mass, damping=damping)
    return replace(nominal, joint=joint, theta=theta, motion=motion, course=course, acts=tuple(acts))


def _climbed(joint: JointLikelihood, theta: Array, motion: Motion) -> tuple[JointLikelihood, Array]:
    """Climbed with the Coriolis forces of ever better velocities."""
    for _ in range(PASSES):
        theta = climb(joint, theta, NEARLY, JointLikelihood.score).theta
        joint = joint.with_better_forces(motion, theta)
    return joint, climb(joint, theta, NEARLY, JointLikelihood.score).theta


def _without(problem: AxisLikelihood, acts: Sequence[Act], course: Course) -> AxisLikelihood:
    axis = problem.axis
    before = np.concatenate([axis.time_s[:1], axis.time_s[:-1]])
    force, reading = axis.force.copy(), problem.reading.copy()
    for act in acts:
        if act.wrench is not None:
            force += mean_before(course.time_s, act.wrench[:, axis.dof], before, axis.time_s)[:, None]
        off = spoilt(problem, act, course)
        if off is not None:
            reading -= off
    return replace(problem, axis=replace(axis, force=force), reading=reading)


def _smoothed(joint: JointLikelihood, theta: Array, motion: Motion) -> Motion:
    nu = motion.nu.copy()
    for problem, place in zip(joint.at(theta), joint.places, strict=True):
        nu[:, problem.axis.dof] = np.interp(motion.time_s, problem.axis.time_s, problem.speed(theta[place]))
    return Motion(motion.time_s, nu)


def _coefficients(joint: JointLikelihood, theta: Array) -> tuple[Array, Array]:
    """Total masses and linear dampings (6,); 0 damping where an axis is not fitted."""
    damping = np.zeros(6)
    for problem, place in zip(joint.problems, joint.places, strict=True):
        damping[problem.axis.dof] = np.exp(theta[place.start + DAMPING])
    return joint.at(theta)[0].masses, damping
