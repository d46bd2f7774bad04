"""Gauss and Newton's equations of the network, its weights eliminated: what is left pulls on the coefficients.

The loss is minus twice the log of the probability of all readings, given coefficients and noise levels:

    |data residual|^2 + |physics residual|^2 + |disturbance|^2, each over its variance, + log det of its curvature,

the last because the weights are integrated out and not merely fitted (Laplace's approximation, exact where the
model is linear): without it a disturbance would be traded for mass. Its slope follows from Fisher's identity: the
slope of the expected loss under the network's own uncertainty, which the selected inverse of the equations gives.
"""

from dataclasses import dataclass, replace

import torch
from torch import Tensor

from identify.estimators.pinn.blocks import factorise, selected_inverse, solve
from identify.estimators.pinn.network import Data, Pull, first_precision, moments, pull, spent
from identify.estimators.pinn.noise import Moments, Noise
from identify.estimators.pinn.physics import Balance
from identify.estimators.pinn.raw import Raw


@dataclass(frozen=True)
class Equations:
    """The equations at given coefficients and noise, with the state eliminated.

    gradient (p,), information, prior (p, p) of the raw parameters. state (N + 1, s): the best one. leaning
    (N + 1, s, p): minus what it changes by with each raw parameter. on, beside: blocks of its covariance.
    """

    gradient: Tensor
    information: Tensor
    prior: Tensor
    state: Tensor
    leaning: Tensor
    on: Tensor
    beside: Tensor
    moments: Moments
    loss: float


@dataclass(frozen=True)
class Eliminated:
    """The state (N + 1, s) eliminated: towards (N + 1, s, k) is what takes each of k columns up, square (k, k) what is
    left of their products. on, beside: blocks of the state's covariance."""

    towards: Tensor
    square: Tensor
    on: Tensor
    beside: Tensor
    log_det: Tensor


def eliminated(pulled: Pull, columns: Tensor, first: Tensor, state: Tensor) -> Eliminated:
    """`columns` (N, R, k), the first of them the residuals; `first` (s,) the precision of the first state about 0."""
    nodes, width = state.shape
    diagonal = torch.zeros(nodes, width, width, dtype=state.dtype, device=state.device)
    diagonal[:-1] += pulled.before.mT @ pulled.before
    diagonal[1:] += pulled.after.mT @ pulled.after
    diagonal[0] += torch.diag(first)
    right = torch.zeros(nodes, width, columns.shape[2], dtype=state.dtype, device=state.device)
    right[:-1] += pulled.before.mT @ columns
    right[1:] += pulled.after.mT @ columns
    right[0, :, 0] += first * state[0]
    factor = factorise(diagonal, pulled.before.mT @ pulled.after)
    towards = solve(factor, right)
    flat = columns.flatten(0, 1)
    square = flat.mT @ flat - right.flatten(0, 1).mT @ towards.flatten(0, 1)
    square[0, 0] += (first * state[0] ** 2).sum()
    return Eliminated(towards, square, *selected_inverse(factor), factor.log_det)


def equations(data: Data, map_: Raw, raw: Tensor, state: Tensor, noise: Noise) -> Equations:
    """The equations at `raw` (p,) and `noise`, linearised about `state` (N + 1, s)."""
    pulled = pull(data, map_, raw, state, noise)
    first = first_precision(noise, len(data.interval.placed))
    found = eliminated(pulled, torch.cat([pulled.residual[:, :, None], pulled.raw], dim=2), first, state)
    step = found.towards[:, :, :1]
    residual, tilt = map_.prior(raw)
    best = state - step[:, :, 0]
    left = pulled.residual - (pulled.before @ step[:-1] + pulled.after @ step[1:])[:, :, 0]
    _, turned = stepped(pulled, data.axes)
    loss = found.square[0, 0] + (residual**2).sum() + found.log_det - 2 * turned.sum()
    return Equations(
        _slope(data, map_, raw, best, noise, found) + tilt * residual,
        found.square[1:, 1:],
        torch.diag(tilt**2),
        best,
        found.towards[:, :, 1:],
        found.on,
        found.beside,
        moments(data, best, replace(pulled, residual=left), found.on, found.beside),
        float(loss) + spent(pulled, noise),
    )


def _slope(data: Data, map_: Raw, raw: Tensor, state: Tensor, noise: Noise, found: Eliminated) -> Tensor:
    """Of half the loss without priors, in the raw parameters, by automatic differentiation of its expectation."""
    with torch.enable_grad():
        asked = raw.detach().clone().requires_grad_()
        there = pull(data, map_, asked, state, noise)
        spread = ((there.before @ found.on[:-1] + 2 * there.after @ found.beside.mT) * there.before).sum()
        spread = spread + ((there.after @ found.on[1:]) * there.after).sum()
        _, turned = stepped(there, data.axes)
        scale = (there.std.log() * there.known).sum()
        expected = 0.5 * ((there.residual**2).sum() + spread) + scale - turned.sum()
        (slope,) = torch.autograd.grad(expected, asked)
    return slope


def entangled(own: Balance, on: Tensor, beside: Tensor, n: int) -> tuple[Tensor, Tensor]:
    """Covariance (N, n, n) of the velocities before and after each interval with its balances."""
    before = on[:-1, :n] @ own.before.mT + beside[:, :n] @ own.after.mT
    after = beside[:, :, :n].mT @ own.before.mT + on[1:, :n] @ own.after.mT
    return before, after


def stepped(pulled: Pull, n: int) -> tuple[Tensor, Tensor]:
    """Slope (N, n, n) of the balances in the velocities after an interval, with angles and depth taken along; and the
    logarithm (N,) of the determinant of balances and positions together."""
    after = pulled.balance.after
    x = after.shape[2] - 2 * n
    position = (pulled.after * pulled.std[:, :, None])[:, 2 * n : 2 * n + x]
    along = torch.linalg.solve(position[:, :, 2 * n :], position[:, :, :n])
    square = after[:, :, :n] - after[:, :, 2 * n :] @ along
    value = torch.linalg.slogdet(square).logabsdet + torch.linalg.slogdet(position[:, :, 2 * n :]).logabsdet
    return square, value
