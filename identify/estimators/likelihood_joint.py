"""The likelihood of all axes together: a mass weighs in its own axis and in the Coriolis forces of the others.

The axes' readings are independent given the Coriolis forces, so that the likelihood is the product of theirs. The
velocities that those forces are made of are the posterior means of each axis's own model: what is unknown of them
does not depend on what is known (Berkson 1950), so it widens the disturbance and does not bias the masses, as
measured velocities would.
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from identify.estimators.likelihood_axis import MASS, AxisLikelihood
from identify.estimators.motion import Motion
from identify.estimators.scoring import weigh

Array = NDArray[np.float64]

ROUGHLY = 0.1
"""Nats: as far as an axis alone is climbed, for the climb of all to start from."""


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
        for i in range(len(self.problems)):
            where, own_gradient, own_information = self.score_of(i, theta)
            gradient[where] += own_gradient
            information[np.ix_(where, where)] += own_information
        return gradient, information

    def score_of(self, i: int, theta: Array) -> tuple[NDArray[np.intp], Array, Array]:
        """What axis i alone gives: the places (k,) in theta that it depends on, gradient (k,) and information."""
        problem, place = self.at(theta)[i], self.places[i]
        dofs = [other.axis.dof for other in self.problems]
        others = [k for k, dof in enumerate(dofs) if problem.axis.coriolis[:, dof].any()]
        gradient, information = weigh(*problem.sensitivities(theta[place], [dofs[k] for k in others]))
        masses = [self.places[k].start + MASS for k in others]
        return np.array([*range(place.start, place.stop), *masses]), gradient, information

    def at(self, theta: Array) -> tuple[AxisLikelihood, ...]:
        """The axes' own likelihoods with the masses of theta in their Coriolis forces."""
        masses = self.problems[0].masses.copy()
        for problem, place in zip(self.problems, self.places, strict=True):
            masses[problem.axis.dof] = np.exp(theta[place.start + MASS])
        return tuple(replace(problem, masses=masses) for problem in self.problems)

    def with_better_forces(self, motion: Motion, theta: Array) -> "JointLikelihood":
        """The same with Coriolis forces of the velocities at theta, and without the readings that are wild there.

        `motion` is where the velocities come from of axes that are not fitted.
        """
        nu = motion.nu.copy()
        problems = self.at(theta)
        for problem, place in zip(problems, self.places, strict=True):
            times_s = problem.axis.time_s
            nu[:, problem.axis.dof] = np.interp(motion.time_s, times_s, problem.speed(theta[place]))
        better = Motion(motion.time_s, nu)
        return JointLikelihood(
            tuple(
                replace(problem.moving(better), reading=problem.without_wild(theta[place]))
                for problem, place in zip(problems, self.places, strict=True)
            )
        )


def alone(problem: AxisLikelihood, theta: Array) -> tuple[Array, Array]:
    """The score of one axis."""
    return weigh(*problem.sensitivities(theta, ()))
