"""A model flown beside a recorded motion: what its equations lack at every instant, and how far it drifts by that.

Whatever is simulated is the difference from the recorded velocity, so that a model without a gap stays at zero:
M d' = f - (C(nu + d) - C(nu)) - D d + S d - K a,  a' = d,  with f what the recorded motion lacks by the model and S by
how much the causes' forces change with velocity (Fossen 2011, eq. 6.1, less itself along the recording).
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from bridge.effects.course import Course
from bridge.effects.effect import Act
from identify.diagnose.cause import Cause
from identify.diagnose.flight import off_by
from identify.diagnose.nominal import Nominal
from identify.estimators.innovations import POSITION
from identify.estimators.likelihood_axis import DAMPING, FORCES, MASS
from identify.estimators.likelihood_joint import JointLikelihood

Array = NDArray[np.float64]

EACH = 2
"""A step of the simulation is so many of the course's: 40 ms."""

NUDGE = np.array([0.01, 0.01, 0.01, 0.02, 0.02, 0.02])
"""By how much velocities are moved to see what the causes' forces do, m/s and rad/s."""


MEANT_S = 2.0
"""So long the slow part of an angle is meant over."""


@dataclass(frozen=True)
class Flown:
    """A model along a recorded motion at uniform times (n,), body axes, SI units.

    dofs: those that are fitted; the others follow what was recorded. mass, damping, stiffness (6,). nu, nu_dot (n, 6):
    recorded. lacking (n, 6): what would have to push beside all that the model knows of. slope (n, 6, 6): of the
    causes' forces by velocity.
    """

    time_s: Array
    dofs: tuple[int, ...]
    mass: Array
    damping: Array
    stiffness: Array
    nu: Array
    nu_dot: Array
    lacking: Array
    slope: Array

    @property
    def step_s(self) -> float:
        return float(self.time_s[1] - self.time_s[0])

    def less(self, wrench: Array) -> "Flown":
        """The same where so much (n, 6) pushes beside what the model knows of."""
        return replace(self, lacking=self.lacking - wrench)

    def off(self, starts: NDArray[np.int64], steps: Sequence[int], errors: Array) -> Array:
        """(w, h, 6): by how much it is off after so many steps from each start; NaN where the recording ends before,
        and in axes that are not fitted. errors (n, 6): of the recorded velocity, 0 where it is taken for true."""
        along = (self.lacking, self.nu, self.slope)
        lacking, nu, slope = (np.ascontiguousarray(one) for one in along)
        out = off_by(
            starts, np.array(sorted(steps), dtype=np.int64), lacking, nu, slope, self.mass, self.damping,
            self.stiffness, np.array(self.dofs), errors, self.step_s,
        )  # fmt: skip
        return np.asarray(out)


def flown(
    model: Nominal,
    theta: Array,
    nu: Array,
    wrench: Array | None = None,
    slope: Array | None = None,
) -> Flown:
    """A fit's equations at `theta` beside a velocity nu (n, 6) at the times of its course.

    wrench (n, 6): of causes that are not in the fit's forces; slope (n, 6, 6): of all causes' but those that the model
    holds anyway.
    """
    course = model.course
    mass, damping = coefficients(model.joint, theta)
    force, stiffness = _pushed(model, theta)
    if wrench is not None:
        force = force + wrench
    nu_dot = np.gradient(nu, course.time_s, axis=0)
    lacking = mass * nu_dot + course.coriolis_of(mass, nu) + damping * nu - force
    dofs = tuple(problem.axis.dof for problem in model.joint.problems)
    lacking[:, [dof for dof in range(6) if dof not in dofs]] = 0.0
    grid = slice(None, None, EACH)
    still = slope_of(model.holds, course)[grid]
    if slope is not None:
        still = still + slope[grid]
    return Flown(
        course.time_s[grid], dofs, mass, damping, stiffness, nu[grid], nu_dot[grid], lacking[grid], still
    )


def coefficients(joint: JointLikelihood, theta: Array) -> tuple[Array, Array]:
    """Total masses and linear dampings (6,); no damping where an axis is not fitted."""
    damping = np.zeros(6)
    for problem, place in zip(joint.problems, joint.places, strict=True):
        damping[problem.axis.dof] = np.exp(theta[place.start + DAMPING])
    return joint.at(theta)[0].masses, damping


def logarithms(joint: JointLikelihood) -> set[int]:
    """The places in theta of masses and dampings."""
    own = {place.start + at for place in joint.places for at in (MASS, DAMPING)}
    return own | set(joint.mass_places)


def wrench_of(causes: Sequence[Cause], course: Course) -> Array:
    """(n, 6): the forces of causes along a course."""
    return summed([cause.act(course) for cause in causes], course)


def summed(acts: Sequence[Act], course: Course) -> Array:
    """(n, 6): the forces of acts together."""
    total = np.zeros_like(course.nu)
    for act in acts:
        if act.wrench is not None:
            total += act.wrench
    return total


def spoilt_by(causes: Sequence[Cause], course: Course) -> Array:
    """(n, 6): by how much causes spoil the readings of velocities and rates."""
    total = np.zeros_like(course.nu)
    for cause in causes:
        act = cause.act(course)
        if act.velocity is not None:
            total[:, :3] += act.velocity
        if act.gyro is not None:
            total[:, 3:] += act.gyro
    return total


def felt_by(causes: Sequence[Cause], course: Course) -> Array:
    """(n, 3): what causes add to the accelerometer's reading beyond what it feels, m/s2."""
    total = np.zeros((len(course.time_s), 3))
    for cause in causes:
        felt = cause.act(course).specific_force
        total += 0.0 if felt is None else felt
    return total


def slope_of(causes: Sequence[Cause], course: Course) -> Array:
    """(n, 6, 6): by how much the causes' forces (rows) change with each velocity."""
    out = np.zeros((len(course.time_s), 6, 6))
    if any(cause.act(course).wrench is not None for cause in causes):
        for dof, h in enumerate(NUDGE):
            moved = np.zeros(6)
            moved[dof] = h
            up, down = (wrench_of(causes, replace(course, nu=course.nu + way * moved)) for way in (1, -1))
            out[:, :, dof] = (up - down) / (2 * h)
    return out


def _pushed(model: Nominal, theta: Array) -> tuple[Array, Array]:
    """(n, 6): what pushes at each instant of the course but for Coriolis forces and damping, and the stiffness (6,)."""
    time_s = model.course.time_s
    force, stiffness = np.zeros((len(time_s), 6)), np.zeros(6)
    for problem, place in zip(model.joint.problems, model.joint.places, strict=True):
        axis = problem.axis
        shapes = problem.shapes @ theta[place][FORCES : problem.noise_place]
        force[:, axis.dof] = between(time_s, axis.time_s, axis.step_s, axis.force.mean(axis=1) + shapes)
        placed = (axis.state_read == POSITION) & np.isfinite(problem.reading)
        if axis.stiffness > 0 and placed.any():
            angle = quiet(time_s, axis.time_s[placed], problem.reading[placed], model.motion.nu[:, axis.dof])
            force[:, axis.dof] -= axis.stiffness * angle
            stiffness[axis.dof] = axis.stiffness
    return force, stiffness


def between(time_s: Array, end_s: Array, step_s: Array, force: Array) -> Array:
    """(n,): the mean forces of steps (m,) that end at end_s, each told in its middle.

    Two readings of one instant, as of a gyro and an attitude, have no step between them that a force could act in.
    """
    lasts = step_s > 0
    return np.asarray(np.interp(time_s, (end_s - 0.5 * step_s)[lasts], force[lasts]))


def quiet(time_s: Array, read_s: Array, angle: Array, rate: Array) -> Array:
    """An angle (n,) with the noise of its readings meant out: what it is beside the integral of its rate changes
    slowly."""
    step_s = float(time_s[1] - time_s[0])
    turned = np.cumsum(rate) * step_s
    beside = np.interp(time_s, read_s, angle) - turned
    half = round(0.5 * MEANT_S / step_s)
    edges = np.clip(np.arange(len(beside))[:, None] + [-half, half + 1], 0, len(beside))
    total = np.concatenate([[0.0], np.cumsum(beside)])
    return np.asarray(turned + (total[edges[:, 1]] - total[edges[:, 0]]) / (edges[:, 1] - edges[:, 0]))
