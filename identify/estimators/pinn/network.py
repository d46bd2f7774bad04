"""The network: the vehicle's velocity and what disturbs it at every instant, as weights; and all that pulls on them.

One hidden layer in time, its units the hat functions between neighbouring instants (each is three ReLUs), so a
weight is the state at an instant and reaches no further than its neighbours: the curvature of the loss is
block-tridiagonal and every weight can be trained at once.
"""

from dataclasses import dataclass, replace

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from identify.estimators.pinn.layout import Layout
from identify.estimators.pinn.noise import Moments, Noise
from identify.estimators.pinn.physics import Balance, Coefficients, Interval, balance, coriolis_forms

POSITION_STD = 3e-5
ROUGHNESS = 2e-5
"""Standard deviations of what straight lines between instants leave out: m or rad; m/s or rad/s."""

FIRST_VELOCITY_STD, FIRST_POSITION_STD = 1.0, 10.0
"""Of the first state, about zero: next to nothing is known of it."""


GATE_SIGMA = 6.0


@dataclass(frozen=True)
class Raw:
    """How coefficients hang on raw parameters (6 + 2 n,): six masses, n dampings, n trims.

    A mass or a damping is `scale` softplus(raw), a trim `scale` raw. The priors: log-normal of `spread` about
    `middle`, normal for trims.
    """

    scale: Tensor
    middle: Tensor
    spread: Tensor
    axes: int

    def values(self, raw: Tensor) -> Tensor:
        soft = torch.nn.functional.softplus(raw)
        return self.scale * torch.where(self._positive(raw), soft, raw)

    def slope(self, raw: Tensor) -> Tensor:
        """Of the values in the raw parameters, (6 + 2 n,)."""
        return self.scale * torch.where(self._positive(raw), torch.sigmoid(raw), torch.ones_like(raw))

    def to_logarithm(self, raw: Tensor) -> Tensor:
        """What one unit of each raw parameter is in the logarithm of its value; of a trim, in the trim itself."""
        slope = self.slope(raw)
        return torch.where(self._positive(raw), slope / self.values(raw), slope)

    def start(self) -> Tensor:
        """The raw parameters of the priors' middle."""
        ratio = self.middle / self.scale
        return torch.where(self._positive(ratio), torch.log(torch.expm1(ratio.clamp_min(1e-6))), ratio)

    def coefficients(self, raw: Tensor) -> Coefficients:
        values = self.values(raw)
        return Coefficients(values[:6], values[6 : 6 + self.axes], values[6 + self.axes :])

    def prior(self, raw: Tensor) -> tuple[Tensor, Tensor]:
        """The priors' pull: residuals over their spreads (6 + 2 n,), and their slopes."""
        values, slope = self.values(raw), self.slope(raw)
        positive = self._positive(raw)
        residual = torch.where(positive, (values / self.middle.clamp_min(1e-12)).log(), values - self.middle)
        return residual / self.spread, torch.where(positive, slope / values, slope) / self.spread

    def _positive(self, like: Tensor) -> Tensor:
        return torch.arange(len(like), device=like.device) < 6 + self.axes


@dataclass(frozen=True)
class Data:
    """A Layout as tensors; `known` (N, C): where something was read."""

    interval: Interval
    value: Tensor
    before: Tensor
    after: Tensor
    swung: Tensor
    scale: Tensor
    known: Tensor
    channel_axis: Tensor

    @property
    def axes(self) -> int:
        return len(self.interval.dofs)


@dataclass(frozen=True)
class Pull:
    """All residuals over their standard deviations, (N, R), and their slopes.

    before, after (N, R, s): in the states at both ends of an interval; raw (N, R, p). The first n rows are the
    physics, then n of the disturbance, the positions, and C of the readings. balance is the physics unscaled,
    physics_std (N, n) its scale.
    """

    residual: Tensor
    before: Tensor
    after: Tensor
    raw: Tensor
    balance: Balance
    physics_std: Tensor


def data_of(layout: Layout, device: torch.device) -> Data:
    """The layout on a device, in float64."""

    def tensor(values: NDArray[np.generic]) -> Tensor:
        return torch.as_tensor(np.ascontiguousarray(values), device=device)

    interval = Interval(
        layout.dofs,
        layout.placed,
        tensor(layout.step_s),
        tensor(layout.push),
        tensor(layout.swing),
        tensor(layout.others),
        tensor(layout.stiffness),
        tensor(layout.drift),
        tensor(coriolis_forms()),
    )
    known = np.isfinite(layout.value)
    return Data(
        interval,
        tensor(np.where(known, layout.value, 0.0)),
        tensor(layout.before),
        tensor(layout.after),
        tensor(layout.swung),
        tensor(layout.scale),
        tensor(known),
        tensor(layout.channel_axis),
    )


def pull(data: Data, map_: Raw, raw: Tensor, state: Tensor, noise: Noise) -> Pull:
    """Residuals and slopes at `raw` (p,) and `state` (N + 1, s)."""
    known, n, count = data.interval, data.axes, len(data.interval.step_s)
    h = known.step_s[:, None]
    given, slope = map_.coefficients(raw), map_.slope(raw)
    own = balance(known, given, state)
    strength = 2 * noise.disturbance**2 / noise.time_constant_s
    mass = given.mass[list(known.dofs)]
    std = (strength * h**3 / 12 + (ROUGHNESS * mass.detach()) ** 2).sqrt()
    physics_raw = torch.cat([own.mass, own.damping, own.trim], dim=2) * slope
    first, second = state[:-1], state[1:]

    kept = torch.exp(-h / noise.time_constant_s)
    drift_std = noise.disturbance * (1 - kept**2).sqrt()
    drift = (second[:, n : 2 * n] - kept * first[:, n : 2 * n]) / drift_std
    zero = torch.zeros(count, n, state.shape[1], dtype=state.dtype, device=state.device)
    drift_before, drift_after = zero.clone(), zero.clone()
    index = torch.arange(n, device=state.device)
    drift_before[:, index, n + index] = -kept / drift_std
    drift_after[:, index, n + index] = 1 / drift_std

    swing = known.swing / mass
    placed = list(known.placed)
    place = torch.arange(len(placed), device=state.device)
    moved = h * (0.5 * (first[:, placed] + second[:, placed] + swing[:, placed]) + known.drift[:, placed])
    position = (second[:, 2 * n :] - first[:, 2 * n :] - moved) / POSITION_STD
    position_before, position_after = zero[:, : len(placed)].clone(), zero[:, : len(placed)].clone()
    position_before[:, place, 2 * n + place] = -1 / POSITION_STD
    position_after[:, place, 2 * n + place] = 1 / POSITION_STD
    position_before[:, place, placed] = position_after[:, place, placed] = -0.5 * h / POSITION_STD

    weight = data.known / (data.scale * noise.sensor)
    swung = data.swung * swing[:, data.channel_axis]
    read = torch.einsum("ncs,ns->nc", data.before, first) + torch.einsum("ncs,ns->nc", data.after, second)
    reading = weight * (read + swung - data.value)
    reading_raw = torch.zeros(count, len(data.channel_axis), len(raw), dtype=state.dtype, device=state.device)
    channel = torch.arange(len(data.channel_axis), device=state.device)
    dof = torch.as_tensor(known.dofs, device=state.device)[data.channel_axis]
    reading_raw[:, channel, dof] = -weight * swung / given.mass[dof] * slope[dof]
    nothing = torch.zeros(count, n + len(placed), len(raw), dtype=state.dtype, device=state.device)
    return Pull(
        torch.cat([own.residual / std, drift, position, reading], dim=1),
        torch.cat(
            [own.before / std[:, :, None], drift_before, position_before, weight[:, :, None] * data.before], dim=1
        ),
        torch.cat([own.after / std[:, :, None], drift_after, position_after, weight[:, :, None] * data.after], dim=1),
        torch.cat([physics_raw / std[:, :, None], nothing, reading_raw], dim=1),
        own,
        std,
    )


def first_precision(noise: Noise, placed: int) -> Tensor:
    """One over the variance of the first state, (s,)."""
    d = noise.disturbance**-2.0
    return torch.cat(
        [
            torch.full_like(d, FIRST_VELOCITY_STD**-2.0),
            d,
            torch.full((placed,), FIRST_POSITION_STD**-2.0, dtype=d.dtype, device=d.device),
        ]
    )


def moments(data: Data, state: Tensor, pulled: Pull, noise: Noise, on: Tensor, beside: Tensor) -> Moments:
    """Expected squares over the network's own uncertainty: blocks of its covariance `on` and `beside` the diagonal."""
    n = data.axes
    rows = slice(-data.value.shape[1], None)
    before, after = pulled.before[:, rows], pulled.after[:, rows]
    spread = (
        torch.einsum("ncs,nst,nct->nc", before, on[:-1], before)
        + 2 * torch.einsum("ncs,nst,nct->nc", before, beside, after)
        + torch.einsum("ncs,nst,nct->nc", after, on[1:], after)
    )
    squares = ((pulled.residual[:, rows] ** 2 + spread) * data.known).sum(dim=0) * noise.sensor**2
    d = state[:, n : 2 * n]
    own = on.diagonal(dim1=1, dim2=2)[:, n : 2 * n] + d**2
    across = beside.diagonal(dim1=1, dim2=2)[:, n : 2 * n] + d[:-1] * d[1:]
    return Moments(squares, data.known.sum(dim=0).to(squares), own[:-1], across, own[1:], own[0])


def spent(data: Data, noise: Noise) -> float:
    """Twice the logarithm of what the residuals of readings and disturbances were divided by, and of the first state."""
    kept = torch.exp(-data.interval.step_s[:, None] / noise.time_constant_s)
    sensor = (noise.sensor.log() * data.known.sum(dim=0)).sum()
    drift = (len(kept) + 1) * noise.disturbance.log().sum() + 0.5 * (1 - kept**2).log().sum()
    return 2 * float(sensor + drift)


def wild(data: Data, map_: Raw, raw: Tensor, noise: Noise, state: Tensor) -> Tensor:
    """Readings (N, C) further off than GATE_SIGMA from what the network says there."""
    rows = slice(-data.value.shape[1], None)
    return pull(data, map_, raw, state, noise).residual[:, rows].abs() > GATE_SIGMA


def without(data: Data, wild: Tensor) -> Data:
    """The data less the readings (N, C) that are wild."""
    return replace(data, known=data.known & ~wild)
