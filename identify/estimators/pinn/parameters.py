"""The network's trained parameters: coefficients and noise levels, with their priors.

The network's own uncertainty is added to its residuals, so that a level is not underestimated because a flexible
network came close to the readings (Dempster, Laird and Rubin 1977; Shumway and Stoffer 1982).
"""

from dataclasses import dataclass

import numpy as np
import torch
from torch import Tensor

from bridge.vehicle.config import Configuration
from identify.estimators.likelihood.priors import (
    DAMPING_RATIO,
    MASS_RATIO,
    PRIOR_STD,
    TRIM_SHARE,
    UNMEASURED_SHARE,
)
from identify.estimators.pinn.layout import Coefficients

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


def raw_of(configuration: Configuration, dofs: tuple[int, ...], device: torch.device) -> Raw:
    """Return the map for a vehicle's configuration with fitted axes `dofs`, and the priors, which are the
    likelihood's."""
    rigid = np.array([configuration.rigid_body(dof)[0] for dof in range(6)])
    fitted = rigid[list(dofs)]
    trim = np.array(
        [max(TRIM_SHARE * configuration.thruster_limit_n * (1.0 if dof < 3 else 0.2), 1e-3) for dof in dofs]
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
    """Noise levels: of each channel, sensor (C,), and of each axis, disturbance (n,), N or N m, with its
    time_constant_s (n,); all but the last are standard deviations."""

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
