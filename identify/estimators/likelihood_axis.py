"""The likelihood of one axis; `likelihood_joint` fits all of a vehicle's together."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from bridge.vehicle.config import Configuration
from identify.estimators.axes import Axis, coupled
from identify.estimators.innovations import innovations, responses, smoothed_velocity, transitions
from identify.estimators.motion import Motion
from identify.estimators.scoring import Maximum, slopes

Array = NDArray[np.float64]

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
    `shapes` (n, k), then the log noise std of each channel. `masses` (6,) of all axes make the Coriolis forces.
    The first shape is a constant: the trim force; the others are the Coriolis forces of the `unmeasured` masses.
    `reading` (n,) is the axis's, NaN where it is not to be used. `word`: what the other axes' Coriolis forces say of
    the mass, and its precision, both of the mass itself, for that is what their forces are linear in.
    """

    axis: Axis
    masses: Array
    shapes: Array
    unmeasured: tuple[int, ...]
    reading: Array
    prior_mean: Array
    prior_precision: Array
    difference: Array
    word: tuple[float, float] = (0.0, 0.0)

    def innovations(self, theta: Array) -> tuple[Array, Array]:
        """Those of the readings, and last how far the mass is from the others' word."""
        error, variance = self.filtered(theta, np.inf)
        read = np.isfinite(self.reading)
        mean, precision = self.word
        off = (np.exp(theta[MASS]) - mean) * np.sqrt(precision)
        return np.append(error[read], off), np.append(variance[read], 1.0)

    def filtered(self, theta: Array, gate_sigma: float) -> tuple[Array, Array]:
        """Innovations and variances of all events, (n,); beyond the gate they are clipped and change nothing."""
        error, variance, _ = self.run_filter(
            theta, self.transition_table(theta), self.mean_force(theta), gate_sigma
        )
        return error, variance

    def sensitivities(self, theta: Array, dofs: Sequence[int]) -> tuple[Array, Array, Array, Array]:
        """Innovations and variances (n,), and their derivatives by theta and then by the log masses of `dofs`.

        Ordered as `innovations` has them.
        """
        axis, noise, force = self.axis, self.noise_place, self.mean_force(theta)
        table = self.transition_table(theta)
        error, variance, gain = self.run_filter(theta, table, force, np.inf)
        read = np.isfinite(self.reading)

        def under_that_force(moved: Array) -> tuple[Array, Array]:
            e, s, _ = self.run_filter(moved, self.transition_table(moved), force, np.inf)
            return e[read], s[read]

        columns = np.column_stack([self.shapes, axis.coriolis[:, list(dofs)] * self.masses[list(dofs)]])
        linear = responses(table, axis.step, columns, self.reading, axis.state_read, gain)[:, read]
        curved = [*range(FORCES), *range(noise, len(theta))]
        size = len(theta) + len(dofs), int(np.count_nonzero(read))
        de, ds = np.zeros(size), np.zeros(size)
        de[curved], ds[curved] = slopes(under_that_force, theta, self.difference, curved)
        de[FORCES:noise], de[len(theta) :] = np.split(linear, [noise - FORCES])
        mean, precision = self.word
        mass, root = np.exp(theta[MASS]), np.sqrt(precision)
        last = np.zeros((len(de), 1))
        last[MASS] = mass * root
        return (
            np.append(error[read], (mass - mean) * root),
            np.append(variance[read], 1.0),
            np.hstack([de, last]),
            np.hstack([ds, 0.0 * last]),
        )

    def speed(self, theta: Array) -> Array:
        """The velocity (n,) at every event given all readings and the parameters."""
        axis = self.axis
        return np.asarray(
            smoothed_velocity(
                self.transition_table(theta), axis.step, self.mean_force(theta), self.reading, axis.state_read,
                self.noise_variance(theta), float(np.exp(theta[DISTURBANCE])), axis.initial,
            )
        )  # fmt: skip

    def moving(self, motion: Motion) -> "AxisLikelihood":
        """The same with the Coriolis forces of another motion."""
        axis = coupled(self.axis, motion)
        shapes = np.column_stack([self.shapes[:, :1], axis.coriolis[:, list(self.unmeasured)]])
        return replace(self, axis=axis, shapes=shapes)

    @property
    def noise_place(self) -> int:
        """Where in theta the noise of the first channel stands."""
        return FORCES + int(self.shapes.shape[1])

    def transition_table(self, theta: Array) -> Array:
        """One transition for each of the axis's different steps; an event's is the row that `axis.step` names."""
        mass, damping, disturbance, time_constant = np.exp(theta[:FORCES]).tolist()
        different_s = self.axis.different_s
        return np.asarray(
            transitions(different_s, mass, damping, self.axis.stiffness, disturbance, time_constant)
        )

    def mean_force(self, theta: Array) -> Array:
        """What drives both halves of every step (n, 2), N or N m: thrust, Coriolis forces, and all shapes."""
        by_shapes = self.shapes @ theta[FORCES : self.noise_place]
        return np.asarray(self.axis.force + (self.axis.coriolis @ self.masses + by_shapes)[:, None])

    def noise_variance(self, theta: Array) -> Array:
        """Of the noise of every event's reading (n,), in its own unit squared."""
        return np.asarray(np.exp(2 * theta[self.noise_place :])[self.axis.channel] * self.axis.scale**2)

    def run_filter(
        self, theta: Array, table: Array, force: Array, gate_sigma: float
    ) -> tuple[Array, Array, Array]:
        """Innovations (n,), their variances (n,) and gains under a `table` and a `force` already made of `theta`."""
        axis = self.axis
        error, variance, gain = innovations(
            table, axis.step, force, self.reading, axis.state_read, self.noise_variance(theta),
            float(np.exp(theta[DISTURBANCE])), axis.initial, gate_sigma,
        )  # fmt: skip
        return error, variance, gain

    def without_wild(self, theta: Array) -> Array:
        """The readings (n,) that a fit at `theta` can believe."""
        error, variance = self.filtered(theta, GATE_SIGMA)
        wild = np.abs(error) >= GATE_SIGMA * np.sqrt(variance) * (1 - 1e-12)
        if wild.sum() > MOST_WILD * np.isfinite(error).sum():
            return self.reading
        return np.where(wild, np.nan, self.reading)


@dataclass(frozen=True)
class AxisFit:
    """The maximum of one axis, what it was found with, and the covariance (p, p) of its theta."""

    problem: AxisLikelihood
    maximum: Maximum
    covariance: Array


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
    loose = []
    for dof in unmeasured:
        spread = UNMEASURED_SHARE * rigid_mass(configuration, dof)
        if spread * np.std(axis.coriolis[:, dof]) > NOTICEABLE * disturbance:
            loose.append(dof)
            shapes.append(axis.coriolis[:, dof])
            width.append(spread)
    noises = [channel.noise for channel in axis.channels]
    motion = [np.log(MASS_RATIO * rigid), np.log(DAMPING_RATIO * rigid), np.log(disturbance), np.log(TIME_S)]
    start = [*motion, *np.zeros(len(shapes)), *np.log(noises)]
    difference = [*[1e-4] * len(motion), *(1e-3 * np.array(width)), *[1e-4] * len(noises)]
    prior_std = [*PRIOR_STD, *width, *(channel.noise_spread for channel in axis.channels)]
    return AxisLikelihood(
        axis,
        masses,
        np.column_stack(shapes),
        tuple(loose),
        axis.reading,
        np.array(start),
        np.array(prior_std) ** -2.0,
        np.array(difference),
    )
