"""Integrate Fossen's equations by fourth-order Runge-Kutta, with the slope by the discrete adjoint; compiled, for
torch.

The adjoint gives the exact slope of the computed path, not of the continuous equations.
"""

from functools import cache
from typing import Any

import numpy as np
import torch
from numba import njit
from numpy.typing import NDArray
from torch import Tensor

from bridge.vehicle.dynamics import coriolis

Array = NDArray[np.float64]
Whole = NDArray[np.int64]


@cache
def coriolis_terms() -> tuple[Whole, Array]:
    """Terms of the Coriolis force, from `bridge`'s own C: indices i, j, k, l (T, 4) and factors s (T,).

    (C(nu) nu)_i is the sum of s M_j nu_k nu_l.
    """
    unit = np.eye(6).tolist()
    rows, signs = [], []
    for j in range(6):
        for k in range(6):
            for m in range(k + 1, 6):
                both = [a + b for a, b in zip(unit[k], unit[m], strict=True)]
                for i, value in enumerate(coriolis(unit[j], both)):
                    if value:
                        rows.append((i, j, k, m))
                        signs.append(value)
    return np.array(rows, dtype=np.int64), np.array(signs)


@cache
def terms_of(dofs: tuple[int, ...]) -> tuple[Whole, Whole, Whole, Whole, Whole, Array]:
    """Return the fitted axes and their Coriolis terms: place of i among these axes, then j, k, l and s."""
    rows, signs = coriolis_terms()
    fitted = np.isin(rows[:, 0], dofs)
    axis = np.array([dofs.index(i) for i in rows[fitted, 0]], dtype=np.int64)
    j, k, m = np.ascontiguousarray(rows[fitted, 1:].T)
    return np.array(dofs, dtype=np.int64), axis, j, k, m, signs[fitted]


@njit(cache=True, error_model="numpy")
def _rate(
    drive: Array, nu: Array, mass: Array, damping: Array, dofs: Whole, axis: Whole, j: Whole, k: Whole, m: Whole,
    sign: Array, out: Array,
) -> None:  # fmt: skip
    """Fill `out` with nu_dot (n,) at velocity nu (6,) under the total force `drive` (n,)."""
    for a in range(len(dofs)):
        out[a] = drive[a] - damping[a] * nu[dofs[a]]
    for t in range(len(axis)):
        out[axis[t]] -= sign[t] * mass[j[t]] * nu[k[t]] * nu[m[t]]
    for a in range(len(dofs)):
        out[a] /= mass[dofs[a]]


@njit(cache=True, error_model="numpy")
def _rate_back(
    g: Array, rate: Array, nu: Array, mass: Array, damping: Array, dofs: Whole, axis: Whole, j: Whole, k: Whole,
    m: Whole, sign: Array, to_nu: Array, to_drive: Array, to_mass: Array, to_damping: Array,
) -> None:  # fmt: skip
    """Propagate the gradient g (n,) of the rate back to its arguments; g is overwritten.

    Fills `to_nu` (6,) with the gradient by nu, and adds the gradients by drive, mass and damping to their arrays.
    """
    to_nu[:] = 0.0
    for a in range(len(dofs)):
        i = dofs[a]
        g[a] /= mass[i]
        to_drive[a] += g[a]
        to_mass[i] -= g[a] * rate[a]
        to_damping[a] -= g[a] * nu[i]
        to_nu[i] -= g[a] * damping[a]
    for t in range(len(axis)):
        f = sign[t] * g[axis[t]]
        to_mass[j[t]] -= f * nu[k[t]] * nu[m[t]]
        to_nu[k[t]] -= f * mass[j[t]] * nu[m[t]]
        to_nu[m[t]] -= f * mass[j[t]] * nu[k[t]]


SHARES = (0.5, 0.5, 1.0)
"""How far along the previous rate the second, third and fourth Runge-Kutta stages lie, in steps."""


@njit(cache=True, error_model="numpy")
def _stages(
    h: float, x: Array, drive: Array, others: Array, mass: Array, damping: Array, dofs: Whole, axis: Whole, j: Whole,
    k: Whole, m: Whole, sign: Array, rates: Array, nu: Array,
) -> None:  # fmt: skip
    """Fill the four rates (4, n) of a step from x (n,), and the velocities nu (4, 6) at which they were evaluated."""
    for stage in range(4):
        at = (stage + 1) // 2
        nu[stage] = others[at]
        for a in range(len(dofs)):
            nu[stage, dofs[a]] = x[a]
            if stage > 0:
                nu[stage, dofs[a]] += h * SHARES[stage - 1] * rates[stage - 1, a]
        _rate(drive[at], nu[stage], mass, damping, dofs, axis, j, k, m, sign, rates[stage])


@njit(cache=True, error_model="numpy")
def forward(
    h: float, start: Array, drive: Array, others: Array, mass: Array, damping: Array, dofs: Whole, axis: Whole,
    j: Whole, k: Whole, m: Whole, sign: Array,
) -> Array:  # fmt: skip
    """Path (S, L + 1, n) from start (S, n) under drive (S, 2 L + 1, n), with velocities of the other axes (S, 2 L +
    1, 6)."""
    segments, n, steps = start.shape[0], start.shape[1], (drive.shape[1] - 1) // 2
    out = np.empty((segments, steps + 1, n))
    rates, nu = np.empty((4, n)), np.empty((4, 6))
    for s in range(segments):
        out[s, 0] = start[s]
        for step in range(steps):
            at = 2 * step
            _stages(
                h, out[s, step], drive[s, at : at + 3], others[s, at : at + 3], mass, damping, dofs, axis, j, k, m,
                sign, rates, nu,
            )  # fmt: skip
            for a in range(n):
                gain = rates[0, a] + 2 * rates[1, a] + 2 * rates[2, a] + rates[3, a]
                out[s, step + 1, a] = out[s, step, a] + h / 6 * gain
    return out


@njit(cache=True, error_model="numpy")
def backward(
    h: float, path: Array, g: Array, drive: Array, others: Array, mass: Array, damping: Array, dofs: Whole,
    axis: Whole, j: Whole, k: Whole, m: Whole, sign: Array,
) -> tuple[Array, Array, Array, Array]:  # fmt: skip
    """Propagate the gradient g (S, L + 1, n) of the path back to start, drive, mass and damping."""
    segments, n, steps = path.shape[0], path.shape[2], path.shape[1] - 1
    to_start, to_drive = np.empty((segments, n)), np.zeros(drive.shape)
    to_mass, to_damping, to_nu = np.zeros(6), np.zeros(n), np.zeros(6)
    rates, nu, pushed = np.empty((4, n)), np.empty((4, 6)), np.empty(n)
    pull, gained = np.empty(n), np.empty(n)
    for s in range(segments):
        pull[:] = g[s, steps]
        for step in range(steps - 1, -1, -1):
            at = 2 * step
            _stages(
                h, path[s, step], drive[s, at : at + 3], others[s, at : at + 3], mass, damping, dofs, axis, j, k, m,
                sign, rates, nu,
            )  # fmt: skip
            to_nu[:] = 0.0
            gained[:] = g[s, step]
            for stage in range(3, -1, -1):
                weight = h / 3 if stage in (1, 2) else h / 6
                for a in range(n):
                    pushed[a] = weight * pull[a]
                    if stage < 3:
                        pushed[a] += h * SHARES[stage] * to_nu[dofs[a]]
                _rate_back(
                    pushed, rates[stage], nu[stage], mass, damping, dofs, axis, j, k, m, sign, to_nu,
                    to_drive[s, at + (stage + 1) // 2], to_mass, to_damping,
                )  # fmt: skip
                for a in range(n):
                    gained[a] += to_nu[dofs[a]]
            for a in range(n):
                pull[a] += gained[a]
        to_start[s] = pull
    return to_start, to_drive, to_mass, to_damping


class _Integrated(torch.autograd.Function):
    """`forward` as a torch function, with `backward` as its gradient."""

    @staticmethod
    def forward(
        ctx: Any,
        start: Tensor,
        drive: Tensor,
        mass: Tensor,
        damping: Tensor,
        others: Tensor,
        terms: tuple[Array, ...],
        h: float,
    ) -> Tensor:
        arrays = [t.detach().contiguous().numpy() for t in (drive, others, mass, damping)]
        path = forward(h, start.detach().contiguous().numpy(), *arrays, *terms)
        ctx.kept = (h, path, arrays, terms)
        return torch.from_numpy(path)

    @staticmethod
    def backward(ctx: Any, *pulls: Any) -> tuple[Tensor | None, ...]:
        h, path, arrays, terms = ctx.kept
        slopes = backward(h, path, pulls[0].contiguous().numpy(), *arrays, *terms)
        return (*(torch.from_numpy(slope) for slope in slopes), None, None, None)


def integrated(
    start: Tensor,
    drive: Tensor,
    mass: Tensor,
    damping: Tensor,
    others: Tensor,
    dofs: tuple[int, ...],
    step_s: float,
) -> Tensor:
    """Velocities (S, L + 1, n) of S segments of L steps from `start` (S, n); differentiable, float64, on the CPU.

    drive (S, 2 L + 1, n), N and N m, at instants and halfway; others (S, 2 L + 1, 6): velocities that are not fitted.
    """
    path = _Integrated.apply(  # type: ignore[no-untyped-call]
        start, drive, mass, damping, others, terms_of(dofs), step_s
    )
    assert isinstance(path, Tensor)
    return path
