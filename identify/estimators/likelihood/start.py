"""The filters of all axes at a rough joint fit: the start of a diagnosis' nominal model and of the network's training.

For the network they also give the expected curvature of their innovations (Gupta and Mehra 1974). The network reaches
the same optimum from a worse start, in more passes.
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from bridge.arrays import Array
from bridge.vehicle.config import Configuration
from identify.estimators.axes.axis import Axes
from identify.estimators.likelihood.axis import DAMPING, DISTURBANCE, FORCES, MASS, TIME_CONSTANT
from identify.estimators.likelihood.fit import axis_fits, rough_fit
from identify.estimators.likelihood.intervals import HOPELESS, LOOSE, stretches
from identify.estimators.likelihood.joint import JointLikelihood
from identify.estimators.likelihood.scoring import climb

NEAR = 1.0
"""Convergence limit of the joint climb of all axes, in nats."""


@dataclass(frozen=True)
class StartValues:
    """Coefficients and noise levels of n axes with C channels, in SI units: mass, damping, trim, disturbance,
    time_constant_s (n,), sensor (C,)."""

    mass: Array
    damping: Array
    trim: Array
    disturbance: Array
    time_constant_s: Array
    sensor: Array

    def row(self) -> Array:
        """All values in the order of the fields, (5 n + C,)."""
        return np.concatenate(list(vars(self).values()))


@dataclass(frozen=True)
class StartFit:
    """The filters of all axes at a rough joint fit, with their channels in the order of the network's layout.

    values: the network's start; theta: the same with all other fitted parameters of the filters.
    """

    built: Axes
    joint: JointLikelihood
    values: StartValues
    theta: Array

    def velocity(self, time_s: Array) -> Array:
        """The filters' velocities at the start, (N, n) at `time_s` (N,)."""
        pairs = zip(self.joint.at(self.theta), self.joint.slices, strict=True)
        return np.column_stack(
            [
                np.interp(time_s, problem.axis.time_s, problem.speed(self.theta[of_axis]))
                for problem, of_axis in pairs
            ]
        )

    def curvature(self, at: StartValues) -> Array:
        """Curvature of half the loss without priors, in logarithms (trims: as they are), (5 n + C,) squared, ordered
        as `StartValues.row`; all other parameters of the filters are projected out."""
        theta = self._theta(at)
        joint = self.joint.with_better_forces(self.built.motion, theta)
        return joint.projected(joint.score(theta)[1], self._indices())

    def near(self, at: StartValues) -> "StartFit":
        """The filters at these coefficients, with the Coriolis forces of the velocities there. Noise levels stay the
        filters' own, because their readings are not the network's."""
        theta = self.theta.copy()
        coefficients = self._indices()[: 3 * len(self.joint.problems)]
        theta[coefficients] = self._theta(at)[coefficients]
        return replace(self, joint=self.joint.with_better_forces(self.built.motion, theta), theta=theta)

    def stretch(self, std: Array) -> Array:
        """Factors on the halves of the intervals, (2 n, 2), for masses and then dampings.

        `std` (2 n,) of their logarithms: the likelihood's shape is examined only for coefficients that are known
        loosely.
        """
        out = np.ones((len(std), 2))
        loose = np.flatnonzero((std > LOOSE) & (std < HOPELESS))
        if len(loose):
            maximum = climb(self.joint, self.theta, NEAR)
            fits = list(axis_fits(self.joint, maximum).values())
            for row in loose.tolist():
                kind, axis = divmod(row, len(fits))
                out[row] = stretches(fits[axis].problem, fits[axis].maximum.theta, (MASS, DAMPING)[kind])
        return out

    def _theta(self, at: StartValues) -> Array:
        theta = self.theta.copy()
        n = len(self.joint.problems)
        row = at.row()
        logarithm = np.ones(len(row), np.bool_)
        logarithm[2 * n : 3 * n] = False
        theta[self._indices()] = np.where(logarithm, np.log(np.where(logarithm, row, 1.0)), row)
        return theta

    def _indices(self) -> NDArray[np.intp]:
        """Index of each value of `StartValues.row` in the filters' theta."""
        first = [of_axis.start for of_axis in self.joint.slices]
        coefficients = [
            [start + at for start in first] for at in (MASS, DAMPING, FORCES, DISTURBANCE, TIME_CONSTANT)
        ]
        sensors = [
            range(of_axis.start + problem.noise_index, of_axis.start + problem.white_index)
            for problem, of_axis in zip(self.joint.problems, self.joint.slices, strict=True)
        ]
        return np.array([index for group in (*coefficients, *sensors) for index in group])


def start_of(built: Axes, configuration: Configuration) -> StartFit:
    """Return the filters of a dive's axes, and their start for the network: each axis alone, then roughly together."""
    begun = rough_fit(built, configuration, ())
    theta = begun.value.maximum.theta
    joint = begun.value.joint.with_better_forces(built.motion, theta)
    theta = climb(joint, theta, NEAR).theta
    return StartFit(built, joint, _values(joint, theta), theta)


def _values(joint: JointLikelihood, theta: Array) -> StartValues:
    """The coefficients and noise levels in theta."""
    thetas = [theta[of_axis] for of_axis in joint.slices]
    mass, damping, disturbance, time_s = (
        np.array([np.exp(part[at]) for part in thetas]) for at in (MASS, DAMPING, DISTURBANCE, TIME_CONSTANT)
    )
    sensor = [
        np.exp(part[problem.noise_index : problem.white_index])
        for part, problem in zip(thetas, joint.problems, strict=True)
    ]
    trim = np.array([part[FORCES] for part in thetas])
    return StartValues(mass, damping, trim, disturbance, time_s, np.concatenate(sensor))
