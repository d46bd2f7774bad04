"""Fossen's equations over the interval between two nodes, taken on the network's own state: residual and slopes.

The weak form with one test function an interval: what momentum gained, less what pushed, is

    R = M (nu1 - nu0) + h (C(nu_m) nu_m + D nu_m + K x_m - push - trim - (d0 + d1) / 2),

with nu_m the mean of the network's velocity. No velocity is differentiated, so noise does no harm, and each line
is a polynomial: its slopes are written down and held equal to automatic differentiation by a test.
"""

from dataclasses import dataclass
from functools import cache

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from bridge.vehicle.dynamics import coriolis

SIX = range(6)


@cache
def coriolis_forms() -> NDArray[np.float64]:
    """(6, 6, 6, 6): c_i = sum_jkl M_j forms[i, j, k, l] nu_k nu_l, symmetric in k and l; from `bridge`'s own C."""
    forms = np.zeros((6, 6, 6, 6))
    unit = np.eye(6)
    for j in SIX:
        one = unit[j].tolist()
        for k in SIX:
            for m in range(k, 6):
                both = np.array(coriolis(one, (unit[k] + unit[m]).tolist()))
                apart = np.array(coriolis(one, unit[k].tolist())) + np.array(coriolis(one, unit[m].tolist()))
                own = 2 * np.array(coriolis(one, unit[k].tolist()))
                forms[:, j, k, m] = forms[:, j, m, k] = 0.5 * (own if k == m else both - apart)
    return forms


@dataclass(frozen=True)
class Coefficients:
    """mass (6,), of all degrees of freedom; damping and trim (n,) of the fitted axes; SI units."""

    mass: Tensor
    damping: Tensor
    trim: Tensor


@dataclass(frozen=True)
class Interval:
    """What is known of the intervals, as tensors; see `layout.Layout`."""

    dofs: tuple[int, ...]
    placed: tuple[int, ...]
    step_s: Tensor
    push: Tensor
    swing: Tensor
    others: Tensor
    stiffness: Tensor
    forms: Tensor


@dataclass(frozen=True)
class Balance:
    """The residual R (N, n) in N s or N m s and what it depends on.

    before, after (N, n, s): slopes in the states at both ends. mass (N, n, 6), damping (N, n, n), trim (N, n, n):
    slopes in the coefficients. mean (N, 6): nu_m. turned (N, n, 6): slope of C(nu_m) nu_m in nu_m.
    """

    residual: Tensor
    before: Tensor
    after: Tensor
    mass: Tensor
    damping: Tensor
    trim: Tensor
    mean: Tensor
    turned: Tensor


def balance(known: Interval, given: Coefficients, state: Tensor) -> Balance:
    """The balance of momentum of every interval; `state` (N + 1, s)."""
    axes, n = list(known.dofs), len(known.dofs)
    first, second, h = state[:-1], state[1:], known.step_s[:, None]
    mass = given.mass[axes]
    mean = known.others.clone()
    mean[:, axes] = mean[:, axes] + 0.5 * (first[:, :n] + second[:, :n]) + 0.5 * known.swing / mass
    by_mass = torch.einsum("ajkl,Nk,Nl->Naj", known.forms[axes], mean, mean)
    turned = 2 * torch.einsum("akl,Nl->Nak", torch.einsum("ajkl,j->akl", known.forms[axes], given.mass), mean)
    gain = second[:, :n] - first[:, :n]
    held = torch.zeros_like(gain)
    for i, axis in enumerate(known.placed):
        held[:, axis] = 0.5 * known.stiffness[axis] * (first[:, 2 * n + i] + second[:, 2 * n + i])
    d = 0.5 * (first[:, n : 2 * n] + second[:, n : 2 * n])
    force = by_mass @ given.mass + given.damping * mean[:, axes] + held - known.push - given.trim - d
    eye = torch.eye(n, dtype=state.dtype, device=state.device)
    nu_slope = 0.5 * h[:, :, None] * (turned[:, :, axes] + torch.diag(given.damping))
    rest = torch.zeros(len(h), n, state.shape[1] - n, dtype=state.dtype, device=state.device)
    rest[:, :, :n] = -0.5 * h[:, :, None] * eye
    for i, axis in enumerate(known.placed):
        rest[:, axis, n + i] = 0.5 * h[:, 0] * known.stiffness[axis]
    mass_slope = h[:, :, None] * by_mass
    mass_slope[:, range(n), axes] += gain
    # The lighter the vehicle, the further its velocity swings under the thrust.
    mass_slope[:, :, axes] -= nu_slope * (known.swing / mass**2)[:, None, :]
    return Balance(
        mass * gain + h * force,
        torch.cat([nu_slope - torch.diag(mass), rest], dim=2),
        torch.cat([nu_slope + torch.diag(mass), rest], dim=2),
        mass_slope,
        h[:, :, None] * torch.diag_embed(mean[:, axes]),
        -h[:, :, None] * eye.expand(len(h), n, n),
        mean,
        turned,
    )
