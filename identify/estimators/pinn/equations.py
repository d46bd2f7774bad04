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

from identify.estimators.pinn.blocks import Factor, factorise, selected_inverse, solve
from identify.estimators.pinn.network import Data, Pull, between, first_precision, moments, pull, spent
from identify.estimators.pinn.noise import Moments, Noise
from identify.estimators.pinn.physics import Balance
from identify.estimators.pinn.raw import Raw

AT_A_TIME = 1024
"""Intervals that the slope is worked out for at once."""


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
    left of their products. The inverse of what `factor` is of is the state's covariance."""

    towards: Tensor
    square: Tensor
    factor: Factor


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
    return Eliminated(towards, square, factor)


def solved(data: Data, map_: Raw, raw: Tensor, state: Tensor, noise: Noise) -> tuple[Tensor, float]:
    """The best state (N + 1, s) and the loss alone, linearised about `state`: to try a step by."""
    pulled = pull(data, map_, raw, state, noise)
    first = first_precision(noise, len(data.interval.placed))
    found = eliminated(pulled, pulled.residual[:, :, None], first, state)
    return state - found.towards[:, :, 0], _loss(map_, raw, noise, pulled, found)


def equations(data: Data, map_: Raw, raw: Tensor, state: Tensor, noise: Noise) -> Equations:
    """The equations at `raw` (p,) and `noise`, linearised about `state` (N + 1, s)."""
    pulled = pull(data, map_, raw, state, noise)
    first = first_precision(noise, len(data.interval.placed))
    found = eliminated(pulled, torch.cat([pulled.residual[:, :, None], pulled.raw], dim=2), first, state)
    on, beside = selected_inverse(found.factor)
    step = found.towards[:, :, :1]
    residual, tilt = map_.prior(raw)
    best = state - step[:, :, 0]
    left = pulled.residual - (pulled.before @ step[:-1] + pulled.after @ step[1:])[:, :, 0]
    return Equations(
        _slope(data, map_, raw, best, noise, on, beside) + tilt * residual,
        found.square[1:, 1:],
        torch.diag(tilt**2),
        best,
        found.towards[:, :, 1:],
        on,
        beside,
        moments(data, best, replace(pulled, residual=left), on, beside),
        _loss(map_, raw, noise, pulled, found),
    )


def _loss(map_: Raw, raw: Tensor, noise: Noise, pulled: Pull, found: Eliminated) -> float:
    residual, _ = map_.prior(raw)
    _, turned = stepped(pulled, map_.axes)
    loss = found.square[0, 0] + (residual**2).sum() + found.factor.log_det - 2 * turned.sum()
    return float(loss) + spent(pulled, noise)


def _slope(
    data: Data, map_: Raw, raw: Tensor, state: Tensor, noise: Noise, on: Tensor, beside: Tensor
) -> Tensor:
    """Of half the loss without priors, in the raw parameters, by automatic differentiation of its expectation.

    The expectation is a sum over intervals: so many at a time stay in the processor's cache.
    """
    slope = torch.zeros_like(raw)
    for start in range(0, len(beside), AT_A_TIME):
        cut = slice(start, min(start + AT_A_TIME, len(beside)))
        nodes = slice(cut.start, cut.stop + 1)
        with torch.enable_grad():
            asked = raw.detach().clone().requires_grad_()
            there = pull(between(data, cut), map_, asked, state[nodes], noise)
            across = 2 * there.after @ beside[cut].mT
            spread = ((there.before @ on[nodes][:-1] + across) * there.before).sum()
            spread = spread + ((there.after @ on[nodes][1:]) * there.after).sum()
            _, turned = stepped(there, data.axes)
            scale = (there.std.log() * there.known).sum()
            expected = 0.5 * ((there.residual**2).sum() + spread) + scale - turned.sum()
            slope += torch.autograd.grad(expected, asked)[0]
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
