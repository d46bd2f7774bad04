"""Fossen's equations over the interval between two nodes, evaluated on the network's own state: residual and slopes.

The weak form with one test function per interval, momentum gained less impulse:

    R = M (nu1 - nu0) + h (C(nu_m) nu_m + D nu_m + K x_m - push - trim - (d0 + d1) / 2),

with nu_m and x_m the means of the network's velocity and of its integral: the trapezium rule, plus the
Euler-Maclaurin correction for forces that differ between the ends. No velocity is differentiated, so noise does no
harm. Each line is a polynomial, so its slopes are written out; a test checks them against automatic differentiation.
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
    """Coriolis tensor (6, 6, 6, 6): c_i = sum_jkl M_j forms[i, j, k, l] nu_k nu_l, symmetric in k and l; from
    `bridge`'s own C."""
    forms = np.zeros((6, 6, 6, 6))
    unit = np.eye(6)
    for j in SIX:
        unit_mass = unit[j].tolist()
        for k in SIX:
            for m in range(k, 6):
                both = np.array(coriolis(unit_mass, (unit[k] + unit[m]).tolist()))
                separate = np.array(coriolis(unit_mass, unit[k].tolist())) + np.array(
                    coriolis(unit_mass, unit[m].tolist())
                )
                squared = 2 * np.array(coriolis(unit_mass, unit[k].tolist()))
                forms[:, j, k, m] = forms[:, j, m, k] = 0.5 * (squared if k == m else both - separate)
    return forms


@dataclass(frozen=True)
class Coefficients:
    """mass (6,), of all degrees of freedom; damping and trim (n,) of the fitted axes; SI units."""

    mass: Tensor
    damping: Tensor
    trim: Tensor


@dataclass(frozen=True)
class Interval:
    """Known quantities of the intervals, as tensors; see `layout.Layout`. forms: see `coriolis_forms`."""

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
    """The residual R (N, n) in N s or N m s and its slopes.

    before, after (N, n, s): slopes in the states at both ends. mean (N, 6): nu_m. by_mean (N, n, n): slope of R in
    the fitted axes' nu_m. by_mass (N, n, 6): slope of C(nu_m) nu_m in the masses. swung (N, n): difference of nu_m
    from the trapezium rule, times mass.
    """

    residual: Tensor
    before: Tensor
    after: Tensor
    mean: Tensor
    by_mean: Tensor
    by_mass: Tensor
    swung: Tensor


def balance(known: Interval, given: Coefficients, state: Tensor) -> Balance:
    """Momentum balance of every interval; `state` (N + 1, s)."""
    axes, n, width = list(known.dofs), len(known.dofs), state.shape[1]
    first, second, h = state[:-1], state[1:], known.step_s[:, None]
    mass = given.mass[axes]
    eye = torch.eye(n, width, dtype=state.dtype, device=state.device)
    force = bending(known, given.damping, width)
    bent = (first - second) @ force.mT
    mean = known.others.clone()
    swung = 0.5 * known.swing + h / 12 * bent
    mean[:, axes] = mean[:, axes] + 0.5 * (first[:, :n] + second[:, :n]) + swung / mass
    by_mass = torch.einsum("ajkl,Nk,Nl->Naj", known.forms[axes], mean, mean)
    turned = 2 * torch.einsum("akl,Nl->Nak", torch.einsum("ajkl,j->akl", known.forms[axes], given.mass), mean)
    gain = second[:, :n] - first[:, :n]
    angle = torch.zeros(n, width, dtype=state.dtype, device=state.device)
    for i, axis in enumerate(known.placed):
        angle[axis, 2 * n + i] = 1.0
    held = known.stiffness * (0.5 * (first + second) @ angle.mT - h / 12 * gain)
    d = 0.5 * (first[:, n : 2 * n] + second[:, n : 2 * n])
    total = by_mass @ given.mass + given.damping * mean[:, axes] + held - known.push - given.trim - d
    slope = h[:, :, None] * (turned[:, :, axes] + torch.diag(given.damping))
    bend = h[:, :, None] / 12 * (force / mass[:, None])
    pull = 0.5 * h[:, :, None] * (known.stiffness[:, None] * angle - eye.roll(n, dims=1))
    turn = h[:, :, None] ** 2 / 12 * known.stiffness[:, None] * eye
    return Balance(
        mass * gain + h * total,
        slope @ (0.5 * eye + bend) + pull + turn - mass[:, None] * eye,
        slope @ (0.5 * eye - bend) + pull - turn + mass[:, None] * eye,
        mean,
        slope,
        by_mass,
        swung,
    )


def by_coefficients(known: Interval, given: Coefficients, state: Tensor, own: Balance) -> Tensor:
    """Slopes (N, n, 6 + 2 n) of the balance `own` at `state` in masses, dampings and trims."""
    axes, n = list(known.dofs), len(known.dofs)
    h = known.step_s[:, None]
    mass, gain = given.mass[axes], state[1:, :n] - state[:-1, :n]
    eye = torch.eye(n, dtype=state.dtype, device=state.device)
    in_mass = h[:, :, None] * own.by_mass
    in_mass[:, range(n), axes] += gain
    # The lighter the vehicle, the further its velocity swings and bends.
    in_mass[:, :, axes] -= own.by_mean * (own.swung / mass**2)[:, None, :]
    in_damping = h[:, :, None] * torch.diag_embed(own.mean[:, axes])
    in_damping = in_damping + own.by_mean * (h / 12 * gain / mass)[:, None, :]
    return torch.cat([in_mass, in_damping, -h[:, :, None] * eye.expand(len(h), n, n)], dim=2)


def bending(known: Interval, damping: Tensor, width: int) -> Tensor:
    """Force at an instant that varies within an interval and bends the velocity, as a matrix (n, s) on the state
    there."""
    n = len(known.dofs)
    out = torch.zeros(n, width, dtype=damping.dtype, device=damping.device)
    each = torch.arange(n, device=damping.device)
    out[each, each] = -damping
    out[each, n + each] = 1.0
    for i, axis in enumerate(known.placed):
        out[axis, 2 * n + i] = -known.stiffness[axis]
    return out
