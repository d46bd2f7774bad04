"""The likelihood of one axis and its maximum; `likelihood` makes an Identification of six of them."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from bridge.vehicle.coefficients import DOFS
from bridge.vehicle.config import Configuration
from identify.estimators.axes import Axis
from identify.estimators.innovations import innovations
from identify.estimators.scoring import Maximum, climb

Array = NDArray[np.float64]

PASSES = 5
"""Fits at most; each takes the masses of the Coriolis forces from the one before."""

SETTLED = 2e-4
MASS, DAMPING, DISTURBANCE, TIME_CONSTANT, FORCES = range(5)
PRIOR_STD = (1.5, 2.5, 3.0, 1.0)
"""Of log mass, damping, disturbance and its time constant: they matter only where a dive is mute."""

MASS_RATIO, DAMPING_RATIO, DISTURBANCE_SHARE, TIME_S = 1.4, 0.7, 7e-3, 2.0
"""Where the climb starts, as shares of the rigid body's mass or inertia, and the disturbance's time constant."""

UNMEASURED_SHARE = 0.5
"""Standard deviation of a mass that nothing in the dive weighs, as a share of the rigid body's."""

NOTICEABLE = 0.05
TRIM_SHARE = 0.05
"""Standard deviation of the trim force as a share of one thruster's limit."""

GATE_SIGMA = 6.0
"""A reading further off than this from what the fit expects is wild."""

MOST_WILD = 0.02
"""Share of wild readings up to which they are the sensor's fault, and left out; more than that is the model's."""


@dataclass(frozen=True)
class AxisLikelihood:
    """The `scoring.Problem` of one axis.

    theta: log M, log D, log disturbance std (N or N m), log its time constant (s), a factor of each column of
    `shapes` (n, k), then the log noise std of each channel. `known` (n, 2) is the force that needs no fitting.
    The first shape is a constant: the trim force. `reading` (n,) is the axis's, NaN where it is not to be used.
    """

    axis: Axis
    known: Array
    shapes: Array
    reading: Array
    prior_mean: Array
    prior_precision: Array
    difference: Array

    def innovations(self, theta: Array) -> tuple[Array, Array]:
        error, variance = self.filtered(theta, np.inf)
        read = np.isfinite(error)
        return error[read], variance[read]

    def filtered(self, theta: Array, gate_sigma: float) -> tuple[Array, Array]:
        """Innovations and variances of all events, (n,); beyond the gate they are clipped and change nothing."""
        axis, noise = self.axis, FORCES + self.shapes.shape[1]
        error: Array
        variance: Array
        error, variance = innovations(
            axis.step_s,
            self.known + (self.shapes @ theta[FORCES:noise])[:, None],
            self.reading,
            axis.state_read,
            np.exp(2 * theta[noise:])[axis.channel] * axis.scale**2,
            float(np.exp(theta[MASS])),
            float(np.exp(theta[DAMPING])),
            axis.stiffness,
            float(np.exp(theta[DISTURBANCE])),
            float(np.exp(theta[TIME_CONSTANT])),
            axis.initial,
            gate_sigma,
        )
        return error, variance

    def without_wild(self, theta: Array) -> Array:
        """The readings (n,) that a fit at `theta` can believe."""
        error, variance = self.filtered(theta, GATE_SIGMA)
        wild = np.abs(error) >= GATE_SIGMA * np.sqrt(variance) * (1 - 1e-12)
        if np.mean(wild) > MOST_WILD:
            return self.reading
        return np.where(wild, np.nan, self.reading)


@dataclass(frozen=True)
class AxisFit:
    """The maximum of one axis and what it was found with."""

    problem: AxisLikelihood
    maximum: Maximum

    @property
    def covariance(self) -> Array:
        return np.asarray(np.linalg.inv(self.maximum.precision), dtype=np.float64)


def rigid_mass(configuration: Configuration, dof: int) -> float:
    """Dry mass or rigid-body inertia of a degree of freedom, kg or kg m2."""
    return configuration.dry_mass_kg if dof < 3 else configuration.inertia_kgm2[dof - 3]


def likelihood_of(
    axis: Axis, configuration: Configuration, masses: Array, unmeasured: Sequence[int]
) -> AxisLikelihood:
    """The likelihood of an axis, `masses` (6,) in its Coriolis forces; its prior's mean is where to start.

    What a mass of an `unmeasured` axis may be off by is a factor to fit, where it makes any difference here.
    """
    rigid = rigid_mass(configuration, axis.dof)
    disturbance = DISTURBANCE_SHARE * rigid
    shapes = [np.ones(len(axis.force))]
    width = [max(TRIM_SHARE * configuration.thruster_limit_n * (1.0 if axis.dof < 3 else 0.2), 1e-3)]
    for dof in unmeasured:
        spread = UNMEASURED_SHARE * rigid_mass(configuration, dof)
        if spread * np.std(axis.coriolis[:, dof]) > NOTICEABLE * disturbance:
            shapes.append(axis.coriolis[:, dof])
            width.append(spread)
    noises = [channel.noise for channel in axis.channels]
    motion = [np.log(MASS_RATIO * rigid), np.log(DAMPING_RATIO * rigid), np.log(disturbance), np.log(TIME_S)]
    start = [*motion, *np.zeros(len(shapes)), *np.log(noises)]
    difference = [*[1e-4] * len(motion), *(1e-3 * np.array(width)), *[1e-4] * len(noises)]
    prior_std = [*PRIOR_STD, *width, *(channel.noise_spread for channel in axis.channels)]
    return AxisLikelihood(
        axis,
        axis.force + (axis.coriolis @ masses)[:, None],
        np.column_stack(shapes),
        axis.reading,
        np.array(start),
        np.array(prior_std) ** -2.0,
        np.array(difference),
    )


def fit_axes(
    axes: tuple[Axis, ...], configuration: Configuration, progress: Callable[[float, str], None]
) -> dict[int, AxisFit]:
    """The fit of every axis by degree of freedom, Coriolis forces made with the masses that come out.

    Every pass leaves out what the one before found wild.
    """
    masses = np.array([MASS_RATIO * rigid_mass(configuration, dof) for dof in range(6)])
    unmeasured = sorted(set(range(6)) - {axis.dof for axis in axes})
    fits: dict[int, AxisFit] = {}
    for turn in range(PASSES):
        before, settled = masses.copy(), True
        for i, axis in enumerate(axes):
            progress((turn + i / len(axes)) / PASSES, f"fitting {DOFS[axis.dof]}")
            problem = likelihood_of(axis, configuration, before, unmeasured)
            start = problem.prior_mean
            if axis.dof in fits:
                start = fits[axis.dof].maximum.theta
                problem = replace(problem, reading=problem.without_wild(start))
                settled &= np.array_equal(problem.reading, fits[axis.dof].problem.reading, equal_nan=True)
            fits[axis.dof] = AxisFit(problem, climb(problem, start))
            masses[axis.dof] = np.exp(fits[axis.dof].maximum.theta[MASS])
        if turn and settled and np.max(np.abs(masses / before - 1.0)) < SETTLED:
            break
    return fits
