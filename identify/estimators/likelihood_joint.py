"""The likelihood of all axes together: a mass weighs in its own axis and in the Coriolis forces of the others.

The axes' readings are independent given the Coriolis forces, so that the likelihood is the product of theirs. The
velocities that those forces are made of are the posterior means of each axis's own model: what is unknown of them
does not depend on what is known (Berkson 1950), so it widens the disturbance and does not bias the masses, as
measured velocities would.

Where a controller used a reading that the recording lacks, the thrust follows the disturbance unseen, and an axis's own
equation takes that for mass. The masses in that equation are then its own and told to nobody: the axis's mass in the
Coriolis forces of the others stands apart, and only these weigh it. What they say goes one way, into the equation (a
cut, Plummer 2015), for its damping's sake.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from identify.estimators.likelihood_axis import MASS, AxisLikelihood
from identify.estimators.motion import Motion
from identify.side_by_side import side_by_side

Array = NDArray[np.float64]

ROUGHLY = 0.1
"""Nats: as far as an axis alone is climbed, for the climb of all to start from."""


@dataclass(frozen=True)
class JointLikelihood:
    """The `scoring.Problem` of all axes: their theta one after another, their innovations too.

    After them in theta stand the log masses of the degrees of freedom `apart`, as the other axes' Coriolis forces know
    them; what such an axis's own theta holds is in its own equation alone. apart_prior (k, 2): their prior's mean and
    precision.
    """

    problems: tuple[AxisLikelihood, ...]
    apart: tuple[int, ...] = ()
    apart_prior: Array = field(default_factory=lambda: np.zeros((0, 2)))

    @property
    def places(self) -> tuple[slice, ...]:
        """Where each axis's own theta stands in that of all."""
        ends = np.cumsum([len(problem.prior_mean) for problem in self.problems])
        starts = [0, *ends][:-1]
        return tuple(slice(int(a), int(b)) for a, b in zip(starts, ends, strict=True))

    @property
    def mass_places(self) -> tuple[int, ...]:
        """Where in theta the mass of each axis stands that the others' Coriolis forces are made of."""
        places, apart = self.places, {dof: k for k, dof in enumerate(self.apart)}
        return tuple(
            places[-1].stop + apart[dof] if (dof := problem.axis.dof) in apart else place.start + MASS
            for problem, place in zip(self.problems, places, strict=True)
        )

    @property
    def prior_mean(self) -> Array:
        return np.concatenate([*(problem.prior_mean for problem in self.problems), self.apart_prior[:, 0]])

    @property
    def prior_precision(self) -> Array:
        own = (problem.prior_precision for problem in self.problems)
        return np.concatenate([*own, self.apart_prior[:, 1]])

    @property
    def difference(self) -> Array:
        return self.started([problem.difference for problem in self.problems])

    def started(self, thetas: Sequence[Array]) -> Array:
        """Theta from those of the axes, each found alone: a mass that stands apart starts where its own does."""
        own = {p.axis.dof: theta[MASS] for p, theta in zip(self.problems, thetas, strict=True)}
        return np.concatenate([*thetas, [own[dof] for dof in self.apart]])

    def innovations(self, theta: Array) -> tuple[Array, Array]:
        problems, places = self.at(theta), self.places
        pairs = side_by_side(lambda i: problems[i].innovations(theta[places[i]]), range(len(places)))
        return np.concatenate([e for e, _ in pairs]), np.concatenate([s for _, s in pairs])

    def score(self, theta: Array) -> tuple[Array, Array]:
        """Gradient (p,) and information (p, p): of each axis by its own theta and by the masses of the others."""
        gradient, information = np.zeros(len(theta)), np.zeros((len(theta), len(theta)))
        parts = side_by_side(lambda i: self.score_of(i, theta), range(len(self.problems)))
        for where, own_gradient, own_information in parts:
            gradient[where] += own_gradient
            information[np.ix_(where, where)] += own_information
        return gradient, information

    def score_of(self, i: int, theta: Array) -> tuple[NDArray[np.intp], Array, Array]:
        """What axis i alone gives: the places (k,) in theta that it depends on, gradient (k,) and information."""
        problem, place = self.at(theta)[i], self.places[i]
        dofs = [other.axis.dof for other in self.problems]
        others = [k for k, dof in enumerate(dofs) if problem.axis.coriolis[:, dof].any()]
        gradient, information = problem.score(theta[place], [dofs[k] for k in others])
        masses = [self.mass_places[k] for k in others]
        return np.array([*range(place.start, place.stop), *masses]), gradient, information

    def at(self, theta: Array) -> tuple[AxisLikelihood, ...]:
        """The axes' own likelihoods with the masses of theta in their Coriolis forces."""
        masses = self.problems[0].masses.copy()
        for problem, place in zip(self.problems, self.mass_places, strict=True):
            masses[problem.axis.dof] = np.exp(theta[place])
        return tuple(replace(problem, masses=masses) for problem in self.problems)

    def with_others_word(self, theta: Array, covariance: Array) -> "JointLikelihood":
        """The same where the own mass of an axis apart is expected as the others' Coriolis forces have it at theta."""
        told = []
        for problem, place in zip(self.problems, self.mass_places, strict=True):
            mean, precision = problem.prior_mean.copy(), problem.prior_precision.copy()
            if problem.axis.dof in self.apart:
                mean[MASS], precision[MASS] = theta[place], 1.0 / covariance[place, place]
            told.append(replace(problem, prior_mean=mean, prior_precision=precision))
        return replace(self, problems=tuple(told))

    def with_better_forces(self, motion: Motion, theta: Array) -> "JointLikelihood":
        """The same with Coriolis forces of the velocities at theta, and without the readings that are wild there.

        `motion` is where the velocities come from of axes that are not fitted.
        """
        nu = motion.nu.copy()
        problems = self.at(theta)
        own = [theta[place] for place in self.places]
        for problem, speed in zip(
            problems, side_by_side(lambda i: problems[i].speed(own[i]), range(len(own))), strict=True
        ):
            nu[:, problem.axis.dof] = np.interp(motion.time_s, problem.axis.shown_s, speed)
        better = Motion(motion.time_s, nu)

        def moved(i: int) -> AxisLikelihood:
            # Half of the way: all of it overshoots, and the passes would swing to and fro about what they come to.
            speed = 0.5 * (problems[i].axis.speed + problems[i].expected_speed(own[i]))
            moving = problems[i].moving(better, speed)
            return replace(moving, reading=problems[i].without_wild(own[i]))

        return replace(self, problems=tuple(side_by_side(moved, range(len(own)))))


def alone(problem: AxisLikelihood, theta: Array) -> tuple[Array, Array]:
    """The score of one axis."""
    return problem.score(theta)
