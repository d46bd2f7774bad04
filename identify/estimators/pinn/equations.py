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
from identify.estimators.pinn.physics import Balance, Interval
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
    trace, log_slope, log_value = _integrated(data, map_, raw, pulled, found.on, found.beside)
    best = state - step[:, :, 0]
    left = pulled.residual - (pulled.before @ step[:-1] + pulled.after @ step[1:])[:, :, 0]
    expected = moments(data, best, replace(pulled, residual=left), found.on, found.beside)
    dofs = list(data.interval.dofs)
    trace[dofs] += expected.mass * (map_.slope(raw) / map_.values(raw))[dofs]
    loss = found.square[0, 0] + (residual**2).sum() + found.log_det - 2 * log_value
    return Equations(
        found.square[0, 1:] + tilt * residual + trace - log_slope,
        found.square[1:, 1:],
        torch.diag(tilt**2),
        best,
        found.towards[:, :, 1:],
        found.on,
        found.beside,
        expected,
        float(loss) + spent(data, pulled, noise),
    )


def _integrated(
    data: Data, map_: Raw, raw: Tensor, pulled: Pull, on: Tensor, beside: Tensor
) -> tuple[Tensor, Tensor, Tensor]:
    """What integrating the weights out adds: slopes of half the log determinant, and of the Jacobian's logarithm."""
    known, n = data.interval, data.axes
    axes = list(known.dofs)
    own, std = pulled.balance, pulled.std[:, :n]
    h = known.step_s[:, None]
    weight = 1 / std**2
    at_before, at_after = entangled(own, on, beside, n)
    both, gained = at_before + at_after, at_after - at_before
    slopes = torch.zeros(6 + 2 * n, dtype=raw.dtype, device=raw.device)
    index = torch.arange(n, device=raw.device)
    slopes[6 : 6 + n] = (weight * 0.5 * h * both[:, index, index]).sum(dim=0)
    slopes[axes] += (weight * gained[:, index, index]).sum(dim=0)
    # d/dM_j of the slope of C(nu) nu: 2 forms[a, j, k, l] nu_l.
    bent = torch.einsum("Na,Nka,Nl->akl", weight * h, both, own.mean)
    slopes[:6] += torch.einsum("ajkl,akl->j", known.forms[axes][:, :, axes], bent)
    square = stepped(own, known)
    value = torch.linalg.slogdet(square).logabsdet
    inverse = torch.linalg.inv(square)
    log_slopes = torch.zeros_like(slopes)
    log_slopes[6 : 6 + n] = (0.5 * h * inverse[:, index, index]).sum(dim=0)
    log_slopes[axes] += inverse[:, index, index].sum(dim=0)
    bent = torch.einsum("N,Nka,Nl->akl", h[:, 0], inverse, own.mean)
    log_slopes[:6] += torch.einsum("ajkl,akl->j", known.forms[axes][:, :, axes], bent)
    # The rows that hang on how the disturbance bends the velocity.
    rows = slice(2 * n, None)
    owner = pulled.owner[rows]
    each = torch.arange(len(owner), device=raw.device)
    with_first = on[:-1] @ pulled.before[:, rows].mT + beside @ pulled.after[:, rows].mT
    with_second = beside.mT @ pulled.before[:, rows].mT + on[1:] @ pulled.after[:, rows].mT
    differ = with_first[:, n + owner, each] - with_second[:, n + owner, each]
    dof = torch.tensor(known.dofs, device=raw.device)[owner]
    unit = pulled.before[:, rows][:, each, n + owner] / map_.values(raw)[dof]
    slopes.index_add_(0, dof, -(unit * differ).sum(dim=0))
    value = (value - std.log().sum(dim=1)).sum()
    return slopes * map_.slope(raw), log_slopes * map_.slope(raw), value


def entangled(own: Balance, on: Tensor, beside: Tensor, n: int) -> tuple[Tensor, Tensor]:
    """Covariance (N, n, n) of the velocities before and after each interval with its balances."""
    before = on[:-1, :n] @ own.before.mT + beside[:, :n] @ own.after.mT
    after = beside[:, :, :n].mT @ own.before.mT + on[1:, :n] @ own.after.mT
    return before, after


def stepped(own: Balance, known: Interval) -> Tensor:
    """Slope (N, n, n) of the balances in the velocities after an interval, angles and depth turned by them too."""
    n = len(known.dofs)
    out = own.after[:, :, :n].clone()
    for i, axis in enumerate(known.placed):
        out[:, :, axis] += 0.5 * known.step_s[:, None] * own.after[:, :, 2 * n + i]
    return out
