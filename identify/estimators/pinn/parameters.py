"""The network's trained parameters: coefficients with priors, noise levels, and the filters' knowledge of both.

The network's own uncertainty is added to its residuals, so that a level is not underestimated because a flexible
network came close to the readings (Dempster, Laird and Rubin 1977; Shumway and Stoffer 1982).

The filter of each axis gives the start of training and the expected curvature of its innovations (Gupta and Mehra
1974). From a worse start the network reaches the same end, in more passes.
"""

from dataclasses import dataclass, replace

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from bridge.vehicle.config import Configuration
from identify.estimators.axes import Axes
from identify.estimators.intervals import HOPELESS, LOOSE, stretches
from identify.estimators.likelihood_axis import (
    DAMPING,
    DAMPING_RATIO,
    DISTURBANCE,
    FORCES,
    MASS,
    MASS_RATIO,
    PRIOR_STD,
    TIME_CONSTANT,
    TRIM_SHARE,
    UNMEASURED_SHARE,
    rigid_mass,
)
from identify.estimators.likelihood_fit import axis_fits, rough_fit
from identify.estimators.likelihood_joint import JointLikelihood
from identify.estimators.pinn.layout import Coefficients
from identify.estimators.scoring import climb

Array = NDArray[np.float64]

NEAR = 1.0
"""Convergence limit, in nats, of the joint climb of all axes before the network starts, or after it has ended."""

HALF_WIDTH = 1e-4
"""Half-width of the central difference in the logarithm of a time constant."""


@dataclass(frozen=True)
class Raw:
    """Map from raw parameters (6 + 2 n,) to coefficients: six masses, n dampings, n trims.

    A mass or a damping is `scale` softplus(raw), a trim `scale` raw. The priors are log-normal of `spread` about
    `middle`, normal for trims. scale, middle, spread (6 + 2 n,); `axes` is n.
    """

    scale: Tensor
    middle: Tensor
    spread: Tensor
    axes: int

    def values(self, raw: Tensor) -> Tensor:
        """Masses, dampings and trims, SI units."""
        soft = torch.nn.functional.softplus(raw)
        return self.scale * torch.where(self._positive(raw), soft, raw)

    def slope(self, raw: Tensor) -> Tensor:
        """Slope of the values in the raw parameters, (6 + 2 n,)."""
        return self.scale * torch.where(self._positive(raw), torch.sigmoid(raw), torch.ones_like(raw))

    def to_logarithm(self, raw: Tensor) -> Tensor:
        """Slope of each value's logarithm in its raw parameter; for a trim, of the trim itself."""
        slope = self.slope(raw)
        return torch.where(self._positive(raw), slope / self.values(raw), slope)

    def raw(self, values: Tensor) -> Tensor:
        """The inverse of `values`."""
        ratio = values / self.scale
        return torch.where(self._positive(ratio), torch.log(torch.expm1(ratio.clamp_min(1e-6))), ratio)

    def coefficients(self, raw: Tensor) -> Coefficients:
        values = self.values(raw)
        return Coefficients(values[:6], values[6 : 6 + self.axes], values[6 + self.axes :])

    def prior(self, raw: Tensor) -> tuple[Tensor, Tensor]:
        """The priors' residuals over their spreads (6 + 2 n,), and the residuals' slopes."""
        values, slope = self.values(raw), self.slope(raw)
        positive = self._positive(raw)
        residual = torch.where(positive, (values / self.middle.clamp_min(1e-12)).log(), values - self.middle)
        return residual / self.spread, torch.where(positive, slope / values, slope) / self.spread

    def _positive(self, like: Tensor) -> Tensor:
        return torch.arange(len(like), device=like.device) < 6 + self.axes


def raw_of(shape: Configuration, dofs: tuple[int, ...], device: torch.device) -> Raw:
    """Return the map and priors for a vehicle's shape with fitted axes `dofs`; the priors are the likelihood's own."""
    rigid = np.array([rigid_mass(shape, dof) for dof in range(6)])
    fitted = rigid[list(dofs)]
    trim = np.array(
        [max(TRIM_SHARE * shape.thruster_limit_n * (1.0 if dof < 3 else 0.2), 1e-3) for dof in dofs]
    )
    mass_spread = [PRIOR_STD[0] if dof in dofs else UNMEASURED_SHARE / MASS_RATIO for dof in range(6)]
    scale = np.concatenate([rigid, DAMPING_RATIO * fitted, trim])
    middle = np.concatenate([MASS_RATIO * rigid, DAMPING_RATIO * fitted, np.zeros(len(dofs))])
    spread = np.concatenate([mass_spread, [PRIOR_STD[1]] * len(dofs), trim])
    tensors = [torch.as_tensor(part, device=device) for part in (scale, middle, spread)]
    return Raw(tensors[0], tensors[1], tensors[2], len(dofs))


DISTURBANCE_SPREAD, TIME_SPREAD = 3.0, 1.0
"""Standard deviations of the priors on the logarithms: they matter only if a dive has no information."""


@dataclass(frozen=True)
class Noise:
    """sensor (C,): standard deviations; disturbance (n,): N or N m, and its time_constant_s (n,)."""

    sensor: Tensor
    disturbance: Tensor
    time_constant_s: Tensor

    def logarithm(self) -> Tensor:
        """Logarithms of all levels, (C + 2 n,)."""
        return torch.cat([self.sensor, self.disturbance, self.time_constant_s]).log()


@dataclass(frozen=True)
class Prior:
    """Prior of the noise levels: log-normal about `middle`; `sensor_spread` (C,) of the sensors'."""

    middle: Noise
    sensor_spread: Tensor

    def spread(self) -> Tensor:
        """Standard deviations of the logarithms, (C + 2 n,)."""
        level = torch.ones_like(self.middle.disturbance)
        return torch.cat([self.sensor_spread, DISTURBANCE_SPREAD * level, TIME_SPREAD * level])

    def residual(self, noise: Noise) -> Tensor:
        """Distances of the levels from the middle, in standard deviations, (C + 2 n,)."""
        return (noise.logarithm() - self.middle.logarithm()) / self.spread()


def of_logarithm(logarithm: Tensor, axes: int) -> Noise:
    """The inverse of `Noise.logarithm`."""
    values = logarithm.exp()
    return Noise(values[: -2 * axes], values[-2 * axes : -axes], values[-axes:])


@dataclass(frozen=True)
class Moments:
    """Expectations of the residuals over the network's own uncertainty.

    Shortfall of expected squares below one, in shares of their variances, summed: sensor (C,) for the part of the
    sensors' noise; wander (n,) for the part of the disturbance that wanders within intervals. d00, d01, d11 (N, n):
    products of the disturbance at both ends of every interval. first (n,): its square at the first node.
    """

    sensor: Tensor
    wander: Tensor
    d00: Tensor
    d01: Tensor
    d11: Tensor
    first: Tensor


def slope(moments: Moments, step_s: Tensor, noise: Noise) -> Tensor:
    """Slope of half the loss without priors, in the logarithms of the levels, (C + 2 n,).

    By Fisher's identity, this is the slope of the expected loss at the moments' own levels.
    """
    squares, _ = _drift(moments, step_s, noise.time_constant_s[None, :])
    disturbance = len(step_s) + 1 - squares[0] / noise.disturbance**2 + moments.wander
    near = torch.exp(torch.tensor([[-HALF_WIDTH], [HALF_WIDTH]], dtype=step_s.dtype, device=step_s.device))
    squares, lost = _drift(moments, step_s, near * noise.time_constant_s)
    cost = 0.5 * squares / noise.disturbance**2 + lost
    slower = (cost[1] - cost[0]) / (2 * HALF_WIDTH) - 0.5 * moments.wander
    return torch.cat([moments.sensor, disturbance, slower])


def _drift(moments: Moments, step_s: Tensor, time_s: Tensor) -> tuple[Tensor, Tensor]:
    """For time constants (g, n): the disturbance's squared innovations in units of its variance, and half the sum of
    the logarithms of the innovations' own variances, (g, n) each."""
    kept = torch.exp(-step_s[None, :, None] / time_s[:, None, :])
    lost = 1 - kept**2
    drift = (moments.d11 - 2 * kept * moments.d01 + kept**2 * moments.d00) / lost
    return drift.sum(dim=1) + moments.first, 0.5 * lost.log().sum(dim=1)


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
        """All values in the order of the fields, (5 n + C,)."""
        return np.concatenate(list(vars(self).values()))


@dataclass(frozen=True)
class Filters:
    """The filters of all axes, with their channels in the order of the layout, and the start that they give the
    network: as `Levels`, and as their own theta with all other fitted parameters."""

    built: Axes
    joint: JointLikelihood
    start: Levels
    theta: Array

    def velocity(self, time_s: Array) -> Array:
        """The filters' velocities at the start, (N, n) at `time_s` (N,)."""
        pairs = zip(self.joint.at(self.theta), self.joint.places, strict=True)
        return np.column_stack(
            [
                np.interp(time_s, problem.axis.time_s, problem.speed(self.theta[place]))
                for problem, place in pairs
            ]
        )

    def curvature(self, at: Levels) -> Array:
        """Curvature of half the loss without priors, in logarithms (trims: as they are), (5 n + C,) squared, ordered
        as `Levels.row`; all other parameters of the filters are projected out."""
        theta = self._theta(at)
        joint = self.joint.with_better_forces(self.built.motion, theta)
        _, information = joint.score(theta)
        kept = self._places()
        others = np.setdiff1d(np.arange(len(theta)), kept)
        nuisance = information[np.ix_(others, others)] + np.diag(joint.prior_precision[others])
        cross = information[np.ix_(kept, others)]
        return np.asarray(information[np.ix_(kept, kept)] - cross @ np.linalg.solve(nuisance, cross.T))

    def near(self, at: Levels) -> "Filters":
        """The filters at these coefficients, with the Coriolis forces of the velocities there. Noise levels stay the
        filters' own, because their readings are not the network's."""
        theta = self.theta.copy()
        coefficients = self._places()[: 3 * len(self.joint.problems)]
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
        """Index of each value of `Levels.row` in the filters' theta."""
        first = [place.start for place in self.joint.places]
        coefficients = [
            [start + at for start in first] for at in (MASS, DAMPING, FORCES, DISTURBANCE, TIME_CONSTANT)
        ]
        sensors = [
            range(place.start + problem.noise_place, place.start + problem.white_place)
            for problem, place in zip(self.joint.problems, self.joint.places, strict=True)
        ]
        return np.array([place for group in (*coefficients, *sensors) for place in group])


def filters_of(built: Axes, configuration: Configuration) -> Filters:
    """Return the filters of a dive's axes, and their start for the network: each axis alone, then roughly together."""
    begun = rough_fit(built, configuration, ())
    theta = begun.value.maximum.theta
    joint = begun.value.joint.with_better_forces(built.motion, theta)
    theta = climb(joint, theta, NEAR, JointLikelihood.score).theta
    return Filters(built, joint, _levels(joint, theta), theta)


def _levels(joint: JointLikelihood, theta: Array) -> Levels:
    """The coefficients and noise levels in theta."""
    thetas = [theta[place] for place in joint.places]
    mass, damping, disturbance, time_s = (
        np.array([np.exp(part[at]) for part in thetas]) for at in (MASS, DAMPING, DISTURBANCE, TIME_CONSTANT)
    )
    sensor = [
        np.exp(part[problem.noise_place : problem.white_place])
        for part, problem in zip(thetas, joint.problems, strict=True)
    ]
    trim = np.array([part[FORCES] for part in thetas])
    return Levels(mass, damping, trim, disturbance, time_s, np.concatenate(sensor))
