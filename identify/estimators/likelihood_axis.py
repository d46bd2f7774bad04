"""The likelihood of one axis and its maximum; `likelihood` makes an Identification of six of them."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bridge.vehicle.coefficients import DOFS
from bridge.vehicle.config import Configuration
from identify.estimators.axes import Axis
from identify.estimators.innovations import innovations
from identify.estimators.readings import noise_std
from identify.estimators.scoring import Maximum, climb

Array = NDArray[np.float64]

PASSES = 5
"""Fits at most; each takes the masses of the Coriolis forces from the one before."""

SETTLED = 2e-4
MASS, DAMPING, DISTURBANCE, TIME_CONSTANT, FORCES = range(5)
PRIOR_STD = (1.5, 2.5, 3.0, 1.0)
"""Of log mass, damping, disturbance and its time constant: they matter only where a dive is mute."""

NOISE_PRIOR_STD = 2.0
MASS_RATIO, DAMPING_RATIO, DISTURBANCE_SHARE, TIME_S = 1.4, 0.7, 7e-3, 2.0
"""Where the climb starts, as shares of the rigid body's mass or inertia, and the disturbance's time constant."""

UNMEASURED_SHARE = 0.5
"""Standard deviation of a mass that nothing in the dive weighs, as a share of the rigid body's."""

NOTICEABLE = 0.05
TRIM_SHARE = 0.05
"""Standard deviation of the trim force as a share of one thruster's limit."""

GATE_SIGMA = 6.0
"""A reading further off is left out, its likelihood held at the gate: no parameter gains by shutting it out."""


@dataclass(frozen=True)
class AxisLikelihood:
    """The `scoring.Problem` of one axis.

    theta: log M, log D, log disturbance std (N or N m), log its time constant (s), a factor of each column of
    `shapes` (n, k), then the log noise std of each channel. `known` (n, 2) is the force that needs no fitting.
    The first shape is a constant: the trim force.
    """

    axis: Axis
    known: Array
    shapes: Array
    gate_sigma: float
    prior_mean: Array
    prior_precision: Array
    difference: Array

    def innovations(self, theta: Array) -> tuple[Array, Array]:
        axis, noise = self.axis, FORCES + self.shapes.shape[1]
        error: Array
        variance: Array
        error, variance = innovations(
            axis.step_s,
            self.known + (self.shapes @ theta[FORCES:noise])[:, None],
            axis.reading,
            axis.state_read,
            np.exp(2 * theta[noise:])[axis.channel] * axis.scale**2,
            float(np.exp(theta[MASS])),
            float(np.exp(theta[DAMPING])),
            axis.stiffness,
            float(np.exp(theta[DISTURBANCE])),
            float(np.exp(theta[TIME_CONSTANT])),
            axis.initial,
            self.gate_sigma,
        )
        read = np.isfinite(error)
        return error[read], variance[read]


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
    axis: Axis, configuration: Configuration, masses: Array, unmeasured: Sequence[int], gate_sigma: float
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
    plain = axis.reading / axis.scale
    noises = [max(noise_std(plain[axis.channel == i]), 1e-6) for i in range(len(axis.channels))]
    motion = [np.log(MASS_RATIO * rigid), np.log(DAMPING_RATIO * rigid), np.log(disturbance), np.log(TIME_S)]
    start = [*motion, *np.zeros(len(shapes)), *np.log(noises)]
    difference = [*[1e-4] * len(motion), *(1e-3 * np.array(width)), *[1e-4] * len(noises)]
    prior_std = [*PRIOR_STD, *width, *[NOISE_PRIOR_STD] * len(noises)]
    return AxisLikelihood(
        axis,
        axis.force + (axis.coriolis @ masses)[:, None],
        np.column_stack(shapes),
        gate_sigma,
        np.array(start),
        np.array(prior_std) ** -2.0,
        np.array(difference),
    )


def fit_axes(
    axes: tuple[Axis, ...], configuration: Configuration, progress: Callable[[float, str], None]
) -> dict[int, AxisFit]:
    """The fit of every axis by degree of freedom, Coriolis forces made with the masses that come out.

    The gate is open on the first pass: far from the answer it would shut out the readings that lead there.
    """
    masses = np.array([MASS_RATIO * rigid_mass(configuration, dof) for dof in range(6)])
    unmeasured = sorted(set(range(6)) - {axis.dof for axis in axes})
    fits: dict[int, AxisFit] = {}
    for turn in range(PASSES):
        before = masses.copy()
        for i, axis in enumerate(axes):
            progress((turn + i / len(axes)) / PASSES, f"fitting {DOFS[axis.dof]}")
            gate = GATE_SIGMA if turn else np.inf
            problem = likelihood_of(axis, configuration, before, unmeasured, gate)
            start = fits[axis.dof].maximum.theta if axis.dof in fits else problem.prior_mean
            fits[axis.dof] = AxisFit(problem, climb(problem, start))
            masses[axis.dof] = np.exp(fits[axis.dof].maximum.theta[MASS])
        if turn and np.max(np.abs(masses / before - 1.0)) < SETTLED:
            break
    return fits
