"""Gauss-Newton equations of the network with its weights eliminated, which leaves equations for the coefficients.

The loss is minus twice the log of the probability of all readings, given coefficients and noise levels:

    |data residual|^2 + |physics residual|^2 + |disturbance|^2, each over its variance, + log det of its curvature.

The last term appears because the weights are integrated out and not merely fitted (Laplace's approximation, exact if
the model is linear); without it a disturbance would be traded for mass. The loss's slope is that of the expected loss
under the network's own uncertainty (Fisher's identity), which the selected inverse of the equations gives.
"""

from dataclasses import dataclass

import numpy as np
import torch
from torch import Tensor

from identify.estimators.pinn.layout import Data, bending, between, by_coefficients
from identify.estimators.pinn.network import (
    Factor,
    Pull,
    Stretch,
    expected_squares,
    factorise,
    first_precision,
    of_disturbance,
    pull,
    selected_inverse,
    shortfall,
    solve,
    spent,
    stretches,
    worked,
)
from identify.estimators.pinn.parameters import Moments, Noise, Raw


def by_raw(data: Data, map_: Raw, raw: Tensor, state: Tensor, pulled: Pull) -> Tensor:
    """Slopes (N, R, p) of the residuals `pulled` at `raw` and `state` in the raw parameters, with fixed variances."""
    n, width = data.axes, state.shape[1]
    given, slope, owner = map_.coefficients(raw), map_.slope(raw), pulled.owner
    out = torch.zeros(*pulled.residual.shape, len(raw), dtype=state.dtype, device=state.device)
    out[:, :n] = by_coefficients(data, given, state, pulled.balance) * slope
    # Positions and readings depend on mass: the velocity swings under the thrust and bends under the disturbance.
    h = data.step_s[:, None].expand(-1, pulled.positions)
    rows = torch.arange(2 * n, len(owner), device=state.device)
    axis = owner[rows]
    dof = torch.tensor(data.dofs, device=state.device)[axis]
    mass = given.mass[dof]
    bent = torch.cat([-(h**2) / 12, data.bent], dim=1) / mass
    swung = torch.cat([-0.5 * h, data.swung], dim=1) * data.swing[:, axis] / mass
    change = state[1:] - state[:-1]
    in_mass = swung - bent * (change @ bending(data, given.damping, width)[axis].mT)
    out[:, rows, dof] = -in_mass / mass * slope[dof]
    out[:, rows, 6 + axis] = bent * change[:, axis] * slope[6 + axis]
    return out * (pulled.known / pulled.std)[:, :, None]


@dataclass(frozen=True)
class Equations:
    """The equations at given coefficients and noise, with the state eliminated.

    gradient (p,): of half the loss. information (6, 6): of the masses of axes that are not fitted, zero elsewhere.
    tilt (p,): slope of the priors' residuals. state (N + 1, s): the best state. on: blocks on the
    diagonal of its covariance.
    moments: expectations for the noise levels.
    """

    gradient: Tensor
    information: Tensor
    tilt: Tensor
    state: Tensor
    on: Tensor
    moments: Moments
    loss: float


def eliminated(
    data: Data, map_: Raw, raw: Tensor, state: Tensor, noise: Noise, others: list[int]
) -> tuple[Tensor, Tensor, Factor]:
    """Eliminate the state from readings and physics, linearised near `state` (N + 1, s).

    The k columns are the residuals, and their slopes in the masses `others`. Return the state (N + 1, s, k) that
    absorbs each, the remainder (k, k) of their products, and the factor of the matrix whose inverse is the state's
    covariance.
    """
    first = first_precision(noise, len(data.placed))
    nodes, width = state.shape

    def gathered(some: Stretch) -> tuple[Tensor, ...]:
        part, near = between(data, some.intervals), state[some.nodes]
        pulled = pull(part, map_, raw, near, noise)
        asked = pulled.residual[:, :, None]
        if others:
            asked = torch.cat([asked, by_raw(part, map_, raw, near, pulled)[:, :, others]], dim=2)
        before, after = pulled.before.mT, pulled.after.mT
        on = (before @ pulled.before, after @ pulled.after, before @ pulled.after)
        return *on, before @ asked, after @ asked, asked.flatten(0, 1).mT @ asked.flatten(0, 1)

    over = stretches(nodes - 1, state.device)
    parts = worked(gathered, over)
    diagonal = torch.zeros(nodes, width, width, dtype=state.dtype, device=state.device)
    right = diagonal.new_zeros(nodes, width, parts[0][3].shape[2])
    for some, part in zip(over, parts, strict=True):
        diagonal[some.before] += part[0]
        diagonal[some.after] += part[1]
        right[some.before] += part[3]
        right[some.after] += part[4]
    above = torch.cat([part[2] for part in parts])
    square = torch.stack([part[5] for part in parts]).sum(dim=0)
    diagonal[0] += torch.diag(first)
    right[0, :, 0] += first * state[0]
    factor = factorise(diagonal, above)
    towards = solve(factor, right)
    square = square - right.flatten(0, 1).mT @ towards.flatten(0, 1)
    square[0, 0] += (first * state[0] ** 2).sum()
    return towards, square, factor


def equations(data: Data, map_: Raw, raw: Tensor, state: Tensor, noise: Noise) -> Equations:
    """Return the equations at `raw` (p,) and `noise`, linearised about `state` (N + 1, s)."""
    others = [dof for dof in range(6) if dof not in data.dofs]
    towards, square, factor = eliminated(data, map_, raw, state, noise, others)
    on, adjacent = selected_inverse(factor)
    best = state - towards[:, :, 0]
    loss, slope, sensor, wander = _expected(data, map_, raw, best, noise, on, adjacent)
    residual, tilt = map_.prior(raw)
    information = torch.zeros(6, 6, dtype=raw.dtype, device=raw.device)
    information[np.ix_(others, others)] = square[1:, 1:]
    squared, across = of_disturbance(best, on, adjacent, data.axes)
    first = first_precision(noise, len(data.placed))
    prior = (residual**2).sum() + (first * best[0] ** 2).sum() + 2 * noise.disturbance.log().sum()
    return Equations(
        slope + tilt * residual,
        information,
        tilt,
        best,
        on,
        Moments(sensor, wander, squared[:-1], across, squared[1:], squared[0]),
        float(loss + prior + factor.log_det),
    )


def _expected(
    data: Data, map_: Raw, raw: Tensor, state: Tensor, noise: Noise, on: Tensor, adjacent: Tensor
) -> list[Tensor]:
    """Sums over all intervals: the residuals' part of the loss at the best state, the slope (p,) of half its
    expectation about that state, by automatic differentiation, and sensor and wander of `Moments`."""
    half = torch.full((), 0.5, dtype=raw.dtype, device=raw.device)

    def sums(some: Stretch) -> tuple[Tensor, ...]:
        with torch.enable_grad():
            asked = raw.detach().clone().requires_grad_()
            there = pull(between(data, some.intervals), map_, asked, state[some.nodes], noise)
            cost = spent(there) - 2 * turned(there, data.axes).sum()
        hangs = (there.before, there.after, there.residual, cost)
        with torch.no_grad():
            squares, by_before, by_after = expected_squares(there, on[some.nodes], adjacent[some.intervals])
            slope = torch.autograd.grad(hangs, asked, (by_before, by_after, there.residual, half))[0]
            loss = (there.residual**2).sum() + cost
            return loss, slope, *shortfall(there, squares, data.axes)

    parts = worked(sums, stretches(len(adjacent), state.device))
    return [torch.stack(part).sum(dim=0) for part in zip(*parts, strict=True)]


def turned(pulled: Pull, n: int) -> Tensor:
    """Log determinant (N,) of balances and positions together in the state after an interval: that of the balances in
    the velocities, with angles and depth following along, and that of the positions."""
    after = pulled.balance.after
    x = after.shape[2] - 2 * n
    position = (pulled.after * pulled.std[:, :, None])[:, 2 * n : 2 * n + x]
    along = torch.linalg.solve(position[:, :, 2 * n :], position[:, :, :n])
    square = after[:, :, :n] - after[:, :, 2 * n :] @ along
    parts: list[Tensor] = [torch.linalg.slogdet(part).logabsdet for part in (square, position[:, :, 2 * n :])]
    return parts[0] + parts[1]
