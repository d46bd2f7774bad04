"""The noise levels beside the network: how good each sensor is, how strong and how slow each disturbance.

Expectation-maximisation (Dempster, Laird and Rubin 1977; Shumway and Stoffer 1982 for state-space models): the
network's own uncertainty stands beside its residuals, so a level is not taken for smaller than it is because a
flexible network came close to the readings.
"""

from dataclasses import dataclass

import torch
from torch import Tensor

DISTURBANCE_SPREAD, TIME_SPREAD = 3.0, 1.0
"""Standard deviations of the priors on the logarithms: they matter only where a dive is mute."""

FASTEST, SLOWEST, TIMES = -1.0, 2.0, 61
"""Of the time constants that are tried, as powers of ten in s, and how many of them."""

NEAR = 1e-4


@dataclass(frozen=True)
class Noise:
    """sensor (C,): standard deviations; disturbance (n,): N or N m, and its time_constant_s (n,)."""

    sensor: Tensor
    disturbance: Tensor
    time_constant_s: Tensor

    def logarithm(self) -> Tensor:
        """(C + 2 n,)"""
        return torch.cat([self.sensor, self.disturbance, self.time_constant_s]).log()


def of_logarithm(logarithm: Tensor, axes: int) -> Noise:
    """The inverse of `Noise.logarithm`."""
    values = logarithm.exp()
    return Noise(values[: -2 * axes], values[-2 * axes : -axes], values[-axes:])


@dataclass(frozen=True)
class Moments:
    """What the network says of its residuals: expectations over its own uncertainty.

    sensor (C,): sums of squared residuals over their scales; readings (C,): how many. d00, d01, d11 (N, n): of the
    disturbance at both ends of every interval; first (n,): squared, at the first node.
    """

    sensor: Tensor
    readings: Tensor
    d00: Tensor
    d01: Tensor
    d11: Tensor
    first: Tensor


def updated(moments: Moments, step_s: Tensor, start: Noise, sensor_spread: Tensor) -> Noise:
    """The levels that make the moments most probable; `start` is the middle of the priors."""
    # A prior of spread s on log sigma, to the quadratic order: worth 1 / s^2 halves of readings.
    weight = 0.5 / sensor_spread**2
    sensor = ((moments.sensor + weight * start.sensor**2) / (moments.readings + weight)).sqrt()
    grid_s = torch.logspace(FASTEST, SLOWEST, TIMES, dtype=step_s.dtype, device=step_s.device)[:, None]
    squares, lost = _drift(moments, step_s, grid_s)
    count = len(step_s) + 1
    weight = 0.5 / DISTURBANCE_SPREAD**2
    variance = (squares + weight * start.disturbance**2) / (count + weight)
    off = (grid_s / start.time_constant_s).log() / TIME_SPREAD
    cost = 0.5 * count * variance.log() + lost + 0.5 * off**2
    best = cost.argmin(dim=0)
    axes = torch.arange(cost.shape[1], device=cost.device)
    return Noise(sensor, variance[best, axes].sqrt(), grid_s[best, 0])


def slope(moments: Moments, step_s: Tensor, noise: Noise, start: Noise, sensor_spread: Tensor) -> Tensor:
    """Of minus the log of the probability of all readings, in the logarithms of the levels, (C + 2 n,).

    Fisher's identity: the slope of the expected loss at the moments' own levels.
    """
    sensor = moments.readings - moments.sensor / noise.sensor**2
    sensor = sensor + (noise.sensor / start.sensor).log() / sensor_spread**2
    squares, _ = _drift(moments, step_s, noise.time_constant_s[None, :])
    disturbance = len(step_s) + 1 - squares[0] / noise.disturbance**2
    disturbance = disturbance + (noise.disturbance / start.disturbance).log() / DISTURBANCE_SPREAD**2
    near = torch.exp(torch.tensor([[-NEAR], [NEAR]], dtype=step_s.dtype, device=step_s.device))
    squares, lost = _drift(moments, step_s, near * noise.time_constant_s)
    cost = 0.5 * squares / noise.disturbance**2 + lost
    slower = (cost[1] - cost[0]) / (2 * NEAR) + (noise.time_constant_s / start.time_constant_s).log() / TIME_SPREAD**2
    return torch.cat([sensor, disturbance, slower])


def _drift(moments: Moments, step_s: Tensor, time_s: Tensor) -> tuple[Tensor, Tensor]:
    """For time constants (g, n) or (g, 1): the disturbance's squared innovations in units of its variance, and half
    the sum of the logarithms of their own, (g, n) each."""
    kept = torch.exp(-step_s[None, :, None] / time_s[:, None, :])
    lost = 1 - kept**2
    drift = (moments.d11 - 2 * kept * moments.d01 + kept**2 * moments.d00) / lost
    return drift.sum(dim=1) + moments.first, 0.5 * lost.log().sum(dim=1)
