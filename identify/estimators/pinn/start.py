"""What each axis's own filter knows: where training starts, and what coefficients and noise levels cost the loss.

A start and not an answer: from coefficients well off it the network comes to the same end, in more passes. The
curvature is the expected one of the innovations (`scoring`, Gupta and Mehra 1974): the network's own equations know
what coefficients are worth at given noise levels, but where a disturbance drives an axis more than its thrusters do,
levels and coefficients are found out together.
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from bridge.vehicle.config import Configuration
from identify.estimators.axes import Axes
from identify.estimators.likelihood_axis import (
    DAMPING,
    DISTURBANCE,
    FORCES,
    MASS,
    TIME_CONSTANT,
)
from identify.estimators.likelihood_fit import axis_fits, rough_fit
from identify.estimators.likelihood_joint import JointLikelihood
from identify.estimators.profile import HOPELESS, LOOSE, stretches
from identify.estimators.scoring import climb

Array = NDArray[np.float64]

NEAR = 1.0
"""Nats: as far as all axes together are climbed, for the network to go on from, or from where the network ended."""


@dataclass(frozen=True)
class Levels:
    """Coefficients and noise levels of n axes with C channels, in SI units: mass, damping, trim, disturbance,
    time_constant_s (n,), sensor (C,)."""

    mass: Array
    damping: Array
    trim: Array
    disturbance: Array
    time_constant_s: Array
    sensor: Array

    def row(self) -> Array:
        """(5 n + C,), one after another in the order of the fields."""
        return np.concatenate(list(vars(self).values()))


@dataclass(frozen=True)
class Filters:
    """The filters of all axes, with their channels in the order of the layout, and the start that they come to for the
    network: as `Levels`, and with all else that they fit as their own theta."""

    built: Axes
    joint: JointLikelihood
    start: Levels
    theta: Array

    def velocity(self, time_s: Array) -> Array:
        """What the filters have of the velocities at the start, (N, n) at `time_s` (N,)."""
        own = zip(self.joint.at(self.theta), self.joint.places, strict=True)
        return np.column_stack(
            [np.interp(time_s, one.axis.time_s, one.speed(self.theta[place])) for one, place in own]
        )

    def curvature(self, at: Levels) -> Array:
        """Of half the loss without priors, in logarithms (trims: as they are), (5 n + C,) squared, ordered as
        `Levels.row`; all else that the filters fit is projected out."""
        theta = self._theta(at)
        joint = self.joint.with_better_forces(self.built.motion, theta)
        _, information = joint.score(theta)
        kept = self._places()
        others = np.setdiff1d(np.arange(len(theta)), kept)
        rest = information[np.ix_(others, others)] + np.diag(joint.prior_precision[others])
        cross = information[np.ix_(kept, others)]
        return np.asarray(information[np.ix_(kept, kept)] - cross @ np.linalg.solve(rest, cross.T))

    def near(self, at: Levels) -> "Filters":
        """The filters at these coefficients, with the Coriolis forces of the velocities there. Noise levels stay their
        own, for their readings are not the network's."""
        theta = self.theta.copy()
        coefficients = self._places()[: 3 * len(self.joint.problems)]
        theta[coefficients] = self._theta(at)[coefficients]
        return replace(self, joint=self.joint.with_better_forces(self.built.motion, theta), theta=theta)

    def stretch(self, std: Array) -> Array:
        """What to multiply the halves of the intervals by, (2 n, 2) of masses and then dampings.

        `std` (2 n,) of their logarithms: only of those that are known loosely the likelihood's shape is asked.
        """
        out = np.ones((len(std), 2))
        loose = np.flatnonzero((std > LOOSE) & (std < HOPELESS))
        if len(loose):
            maximum = climb(self.joint, self.theta, NEAR, JointLikelihood.score)
            fits = list(axis_fits(self.joint, maximum).values())
            for row in loose.tolist():
                kind, axis = divmod(row, len(fits))
                out[row] = stretches(fits[axis].problem, fits[axis].maximum.theta, (MASS, DAMPING)[kind])
        return out

    def _theta(self, at: Levels) -> Array:
        theta = self.theta.copy()
        n = len(self.joint.problems)
        row = at.row()
        logarithm = np.ones(len(row), np.bool_)
        logarithm[2 * n : 3 * n] = False
        theta[self._places()] = np.where(logarithm, np.log(np.where(logarithm, row, 1.0)), row)
        return theta

    def _places(self) -> NDArray[np.intp]:
        """Where each value of `Levels.row` stands in the filters' theta."""
        first = [place.start for place in self.joint.places]
        own = [[start + at for start in first] for at in (MASS, DAMPING, FORCES, DISTURBANCE, TIME_CONSTANT)]
        sensors = [
            range(place.start + problem.noise_place, place.start + problem.white_place)
            for problem, place in zip(self.joint.problems, self.joint.places, strict=True)
        ]
        return np.array([place for group in (*own, *sensors) for place in group])


def filters_of(built: Axes, configuration: Configuration) -> Filters:
    """The filters of a dive's axes, and the start that they come to: each alone, then roughly together."""
    begun = rough_fit(built, configuration, ())
    theta = begun.value.maximum.theta
    joint = begun.value.joint.with_better_forces(built.motion, theta)
    theta = climb(joint, theta, NEAR, JointLikelihood.score).theta
    return Filters(built, joint, _levels(joint, theta), theta)


def _levels(joint: JointLikelihood, theta: Array) -> Levels:
    """What theta says."""
    found = [theta[place] for place in joint.places]
    mass, damping, disturbance, time_s = (
        np.array([np.exp(own[at]) for own in found]) for at in (MASS, DAMPING, DISTURBANCE, TIME_CONSTANT)
    )
    sensor = [
        np.exp(own[problem.noise_place : problem.white_place])
        for own, problem in zip(found, joint.problems, strict=True)
    ]
    trim = np.array([own[FORCES] for own in found])
    return Levels(mass, damping, trim, disturbance, time_s, np.concatenate(sensor))
