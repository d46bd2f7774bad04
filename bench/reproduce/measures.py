"""The paper's measures of its validation dives, computed from ours, and the coupling of the axes by least squares.

tau = M nu_dot + C(nu) nu + D nu with M symmetric and D full; C follows from M, whatever its shape (Fossen 2011,
theorem 3.2): C nu = (-r p_v, r p_u, u p_v - v p_u) with the momenta p = M nu. The equation is linear in all fifteen
terms.
"""

import math
from dataclasses import dataclass

import numpy as np

from bridge.arrays import Array
from bridge.errors import FitError
from bridge.vehicle.config import VehicleFile
from bridge.vehicle.thrusters import allocation_matrix, thrust_curve
from identify.align import AlignedDive
from identify.dive import Dive, Signal
from identify.validation.tracking import phases

HEADING_COLUMN = 12
SLOW = 1e-3
LATE_SHARE = 0.5
SAME_SPEED_M_S = 0.005


@dataclass(frozen=True)
class Turn:
    """Tracking of a turn: lag in s over its second half, angle past the end and mean |error| in degrees."""

    lag_s: float
    overshoot_deg: float
    error_deg: float


@dataclass(frozen=True)
class Demand:
    """Load of the horizontal thrusters at a steady speed: the sum of |T| in N, and of |T|^1.5 in N^1.5."""

    thrust_n: float
    ideal_power: float


def heading(dive: Dive) -> tuple[Signal, Signal]:
    """Measured and desired heading, (n, 1) rad, unwrapped."""
    assert dive.attitude is not None
    assert dive.nu_ref is not None
    w, x, y, z = dive.attitude.value.T
    yaw = np.unwrap(np.arctan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z)))
    wanted = np.unwrap(dive.nu_ref.value[:, HEADING_COLUMN])
    wanted = wanted + math.tau * round((float(yaw[0]) - float(wanted[0])) / math.tau)
    return Signal(dive.attitude.time_s, yaw[:, None]), Signal(dive.nu_ref.time_s, wanted[:, None])


def span(dive: Dive, dof: int) -> tuple[float, float]:
    """First and last time at which the velocity reference of degree of freedom `dof` is not zero, boot time in s."""
    assert dive.nu_ref is not None
    moving = dive.nu_ref.time_s[np.abs(dive.nu_ref.value[:, dof]) > SLOW]
    return float(moving[0]), float(moving[-1])


def turned(dive: Dive) -> Turn:
    measured, wanted = heading(dive)
    assert dive.nu_ref is not None
    time_s = dive.nu_ref.time_s
    rate = dive.nu_ref.value[:, 5]
    moving = np.flatnonzero(np.abs(rate) > SLOW)
    first, last = int(moving[0]), int(moving[-1])
    behind = (wanted.value - measured.at(time_s))[:, 0]
    way = math.copysign(1.0, float(rate[first : last + 1].sum()))
    cruising = moving[np.abs(rate[moving]) > (1 - 1e-6) * np.abs(rate).max()]
    late = cruising[int(LATE_SHARE * len(cruising)) :]
    return Turn(
        float(np.mean(behind[late] / rate[late])),
        max(math.degrees(float((-way * behind[last:]).max())), 0.0),
        math.degrees(float(np.abs(behind[first:]).mean())),
    )


def steady_speed(dive: Dive, dof: int) -> float:
    """Mean measured speed while the reference of an axis is steady, m/s."""
    assert dive.velocity is not None
    assert dive.nu_ref is not None
    known = np.isfinite(dive.velocity.value[:, dof])
    time_s = dive.velocity.time_s[known]
    wanted = dive.nu_ref.at(time_s)
    steady = phases(wanted[:, dof], wanted[:, 6 + dof]).steady
    return float(dive.velocity.value[known, dof][steady].mean())


def demand(dive: Dive, file: VehicleFile, configuration: str, speed_m_s: float) -> Demand:
    """Demand on the thrusters that can push along surge, during pure surge at a steady speed."""
    assert dive.pwm is not None
    assert dive.nu_ref is not None
    shape, curve = file.vehicle.configurations[configuration], file.vehicle.thrust_curve
    along = np.abs(allocation_matrix(shape)[0]) > 0.1
    wanted = dive.nu_ref.at(dive.pwm.time_s)
    at_speed = np.abs(np.abs(wanted[:, 0]) - speed_m_s) < SAME_SPEED_M_S
    alone = np.abs(wanted[:, [1, 5, 6]]).max(axis=1) < SAME_SPEED_M_S
    pwm_us = dive.pwm.value[at_speed & alone][:, : len(along)][:, along]
    thrust: Array = np.abs(thrust_curve(curve, file.path.parent).thrust(pwm_us))
    return Demand(float(thrust.sum(axis=1).mean()), float((thrust**1.5).sum(axis=1).mean()))


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
