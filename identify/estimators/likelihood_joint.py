"""All axes of a vehicle together: a mass weighs in its own axis and in the Coriolis forces of the others.

The axes' readings are independent given the Coriolis forces, so that the likelihood is the product of theirs. The
velocities that those forces are made of are the posterior means of each axis's own model: what is unknown of them
does not depend on what is known (Berkson 1950), so it widens the disturbance and does not bias the masses, as
measured velocities would.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from bridge.vehicle.coefficients import DOFS
from bridge.vehicle.config import Configuration
from identify.estimators.axes import Axes, Motion
from identify.estimators.likelihood_axis import (
    DAMPING,
    FORCES,
    MASS,
    MASS_RATIO,
    AxisFit,
    AxisLikelihood,
    likelihood_of,
    rigid_mass,
)
from identify.estimators.scoring import Maximum, climb, weigh

Array = NDArray[np.float64]

PASSES = 6
"""Fits at most; each makes the Coriolis forces of the velocities that the one before came to."""

SETTLED = 0.02
"""Passes end where no coefficient moves by more than this share of its standard error."""

ROUGHLY = 0.1


@dataclass(frozen=True)
class JointLikelihood:
    """The `scoring.Problem` of all axes: their theta one after another, their innovations too."""

    problems: tuple[AxisLikelihood, ...]

    @property
    def places(self) -> tuple[slice, ...]:
        """Where each axis's own theta stands in that of all."""
        ends = np.cumsum([len(problem.prior_mean) for problem in self.problems])
        starts = [0, *ends[:-1]]
        return tuple(slice(int(a), int(b)) for a, b in zip(starts, ends, strict=True))

    @property
    def prior_mean(self) -> Array:
        return np.concatenate([problem.prior_mean for problem in self.problems])

    @property
    def prior_precision(self) -> Array:
        return np.concatenate([problem.prior_precision for problem in self.problems])

    @property
    def difference(self) -> Array:
        return np.concatenate([problem.difference for problem in self.problems])

    def innovations(self, theta: Array) -> tuple[Array, Array]:
        pairs = [p.innovations(theta[place]) for p, place in zip(self.at(theta), self.places, strict=True)]
        return np.concatenate([e for e, _ in pairs]), np.concatenate([s for _, s in pairs])

    def score(self, theta: Array) -> tuple[Array, Array]:
        """Gradient (p,) and information (p, p): of each axis by its own theta and by the masses of the others."""
        gradient, information = np.zeros(len(theta)), np.zeros((len(theta), len(theta)))
        dofs = [problem.axis.dof for problem in self.problems]
        first = [place.start + MASS for place in self.places]
        for problem, place in zip(self.at(theta), self.places, strict=True):
            others = [i for i, dof in enumerate(dofs) if problem.axis.coriolis[:, dof].any()]
            own = weigh(*problem.sensitivities(theta[place], [dofs[i] for i in others]))
            where = np.array([*range(place.start, place.stop), *(first[i] for i in others)])
            gradient[where] += own[0]
            information[np.ix_(where, where)] += own[1]
        return gradient, information

    def at(self, theta: Array) -> tuple[AxisLikelihood, ...]:
        """The axes' own likelihoods with the masses of theta in their Coriolis forces."""
        masses = self.problems[0].masses.copy()
        for problem, place in zip(self.problems, self.places, strict=True):
            masses[problem.axis.dof] = np.exp(theta[place.start + MASS])
        return tuple(replace(problem, masses=masses) for problem in self.problems)


@dataclass(frozen=True)
class JointFit:
    """The fits of the axes by degree of freedom, and what is known of all their coefficients together.

    covariance (12, 12) of the log masses and then the log dampings of the six degrees of freedom, NaN for those that
    are not fitted. information (3 k, 3 k): what the dive alone says of log mass, log damping and trim force of the
    k axes, in the order of `fits`, all else projected out.
    """

    fits: dict[int, AxisFit]
    covariance: Array
    information: Array


def fit_axes(built: Axes, configuration: Configuration, progress: Callable[[float, str], None]) -> JointFit:
    """The joint fit of all axes. Every pass leaves out what the one before found wild."""
    axes = built.axes
    if not axes:
        return JointFit({}, np.full((12, 12), np.nan), np.zeros((0, 0)))
    masses = np.array([MASS_RATIO * rigid_mass(configuration, dof) for dof in range(6)])
    unmeasured = sorted(set(range(6)) - {axis.dof for axis in axes})
    problems = []
    theta = np.zeros(0)
    for i, axis in enumerate(axes):
        progress(0.3 * i / len(axes), f"fitting {DOFS[axis.dof]}")
        problem = likelihood_of(axis, configuration, masses, unmeasured)
        found = climb(problem, problem.prior_mean, ROUGHLY, alone)
        problems.append(problem)
        theta = np.concatenate([theta, found.theta])
    joint = JointLikelihood(tuple(problems))
    maximum = climb(joint, theta, ROUGHLY, JointLikelihood.score)
    for turn in range(PASSES):
        progress(0.3 + 0.7 * turn / PASSES, "fitting all axes together")
        before = maximum.theta
        joint = _with_better_forces(joint, built.motion, before)
        maximum = climb(joint, before, score=JointLikelihood.score)
        std = np.sqrt(np.diag(np.linalg.inv(maximum.precision)))
        moved = np.abs(maximum.theta - before) / std
        kept = [place.start + at for place in joint.places for at in (MASS, DAMPING)]
        if turn and np.max(moved[kept]) < SETTLED:
            break
    return _taken_apart(joint, maximum)


def alone(problem: AxisLikelihood, theta: Array) -> tuple[Array, Array]:
    """The score of one axis."""
    return weigh(*problem.sensitivities(theta, ()))


def _with_better_forces(joint: JointLikelihood, motion: Motion, theta: Array) -> JointLikelihood:
    """The likelihood with Coriolis forces of the velocities at theta, and without the readings that are wild there."""
    nu = motion.nu.copy()
    problems = joint.at(theta)
    for problem, place in zip(problems, joint.places, strict=True):
        times_s = problem.axis.time_s
        nu[:, problem.axis.dof] = np.interp(motion.time_s, times_s, problem.speed(theta[place]))
    better = Motion(motion.time_s, nu)
    believed = [
        problem.without_wild(theta[place]) for problem, place in zip(problems, joint.places, strict=True)
    ]
    return JointLikelihood(
        tuple(
            replace(problem.moving(better), reading=reading)
            for problem, reading in zip(problems, believed, strict=True)
        )
    )


def _taken_apart(joint: JointLikelihood, maximum: Maximum) -> JointFit:
    whole: Array = np.asarray(np.linalg.inv(maximum.precision), dtype=np.float64)
    fits = {}
    covariance = np.full((12, 12), np.nan)
    for problem, place in zip(joint.at(maximum.theta), joint.places, strict=True):
        own = replace(
            maximum,
            theta=maximum.theta[place],
            information=maximum.information[place, place],
            precision=maximum.precision[place, place],
        )
        fits[problem.axis.dof] = AxisFit(_with_others_word(problem, own), own, whole[place, place])
    rows = [dof + 6 * kind for kind in range(2) for dof in fits]
    where = [place.start + at for at in (MASS, DAMPING) for place in joint.places]
    covariance[np.ix_(rows, rows)] = whole[np.ix_(where, where)]
    return JointFit(fits, covariance, _projected(joint, maximum.information))


def _with_others_word(problem: AxisLikelihood, own: Maximum) -> AxisLikelihood:
    """The axis's likelihood with what the others say of its mass as a prior: its maximum, too, lies at `own`."""
    gradient, information = alone(problem, own.theta)
    precision, mean = problem.prior_precision.copy(), problem.prior_mean.copy()
    precision[MASS] += max(float(own.information[MASS, MASS] - information[MASS, MASS]), 0.0)
    mean[MASS] = own.theta[MASS] - gradient[MASS] / precision[MASS]
    return replace(problem, prior_mean=mean, prior_precision=precision)


def _projected(joint: JointLikelihood, information: Array) -> Array:
    kept = np.array([place.start + at for place in joint.places for at in (MASS, DAMPING, FORCES)])
    others = np.setdiff1d(np.arange(len(information)), kept)
    rest = information[np.ix_(others, others)] + np.diag(joint.prior_precision[others])
    cross = information[np.ix_(kept, others)]
    return np.asarray(information[np.ix_(kept, kept)] - cross @ np.linalg.solve(rest, cross.T))
