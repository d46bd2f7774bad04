"""Coupling of the axes: full mass and damping matrices of surge, sway and yaw, by least squares.

tau = M nu_dot + C(nu) nu + D nu with M symmetric and D full; C follows from M, whatever its shape (Fossen 2011,
theorem 3.2): C nu = (-r p_v, r p_u, u p_v - v p_u) with the momenta p = M nu. The equation is linear in all fifteen
terms.
"""

from dataclasses import dataclass

import numpy as np

from bridge.errors import FitError
from identify.dive import Array
from identify.filters import AlignedDive

DOFS = (0, 1, 5)
BLOCKS = 30
LETTERS = "uvr"
UPPER = ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))


@dataclass(frozen=True)
class Term:
    """One matrix entry in SI units, its standard error, and its size relative to the diagonal.

    `share` is the value divided by the square root of the product of the two diagonal entries of its row and column.
    """

    name: str
    value: float
    std: float
    share: float

    @property
    def diagonal(self) -> bool:
        return self.name[-1] == self.name[-2]


def matrices(grid: AlignedDive) -> tuple[Term, ...]:
    """Return all fifteen terms, masses first; standard errors come from a jackknife over blocks of time.

    Raises FitError when the dive does not excite all three axes.
    """
    rows = grid.valid
    nu, nu_dot, tau = (a[rows][:, DOFS] for a in (grid.nu, grid.nu_dot, grid.tau))
    design, target = _design(nu, nu_dot), tau[:, :, None]
    normal = np.einsum("nai,naj->nij", design, design)
    right = np.einsum("nai,nak->ni", design, target)
    if np.linalg.matrix_rank(normal.sum(axis=0), hermitian=True) < normal.shape[1]:
        raise FitError(
            "the dive does not move surge, sway and yaw: their coupling can't be told; dive all three"
        )
    parts = np.array_split(np.arange(len(nu)), BLOCKS)
    normals = np.array([normal[part].sum(axis=0) for part in parts])
    rights = np.array([right[part].sum(axis=0) for part in parts])
    solution = np.linalg.solve(normals.sum(axis=0), rights.sum(axis=0))
    without = np.array(
        [
            np.linalg.solve(normals.sum(axis=0) - n, rights.sum(axis=0) - r)
            for n, r in zip(normals, rights, strict=True)
        ]
    )
    std = np.sqrt((BLOCKS - 1) * np.mean((without - without.mean(axis=0)) ** 2, axis=0))
    return _named(solution, std)


def _design(nu: Array, nu_dot: Array) -> Array:
    """Regressor, shape (n, 3, 15): the wrench in surge, sway and yaw per unit of each term."""
    u, v, r = nu.T
    columns = []
    for i, j in UPPER:
        mass = np.zeros((3, 3))
        mass[i, j] = mass[j, i] = 1.0
        p_u, p_v, _ = mass @ nu.T
        columns.append(mass @ nu_dot.T + np.array([-r * p_v, r * p_u, u * p_v - v * p_u]))
    for i in range(3):
        for j in range(3):
            damping = np.zeros((3, 3))
            damping[i, j] = 1.0
            columns.append(damping @ nu.T)
    stacked: Array = np.moveaxis(np.array(columns), 0, 2).transpose(1, 0, 2)
    return stacked


def _named(value: Array, std: Array) -> tuple[Term, ...]:
    places = [("M", i, j) for i, j in UPPER] + [("D", i, j) for i in range(3) for j in range(3)]
    scale = {(m, i): float(x) for (m, i, j), x in zip(places, value, strict=True) if i == j}
    return tuple(
        Term(
            f"{m}_{LETTERS[i]}{LETTERS[j]}",
            float(x),
            float(s),
            float(x) / float(np.sqrt(abs(scale[m, i] * scale[m, j]))),
        )
        for (m, i, j), x, s in zip(places, value, std, strict=True)
    )
