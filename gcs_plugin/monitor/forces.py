"""The forces of the causes that are tried on a departure, at unit size: those of the effects of the same names in
`identify.effects`, written for a second of a live dive."""

from typing import Final

import numpy as np
from numpy.typing import NDArray

from bridge.vehicle.dynamics import coriolis
from gcs_plugin.monitor.model import Model

Array = NDArray[np.float64]

NUDGE_M_S: Final = 0.05
DRAGGED: Final = (0, 1, 2, 5)
"""Axes in which a hull can grow more drag."""


def names_of(model: Model) -> tuple[str, ...]:
    """Names of the rows of `Drift.causes`: a thruster that gives nothing, water that moves north and east by 1 m/s, a
    pull of 1 N north, east and down, a line of 1 N/m to where the watch began, drag of 1 N s2/m2 in DRAGGED."""
    return (
        *(f"thruster {number}" for number in range(1, len(model.configuration.thrusters) + 1)),
        *("water north", "water east", "pull north", "pull east", "pull down", "line"),
        *(f"drag {dof}" for dof in DRAGGED),
    )


def forces(model: Model, nu: Array, thrust: Array, attitude: Array, places: Array) -> Array:
    """Forces (n, c, 6) of the causes in the order of `names_of`, by velocity (n, 6), thrust (n, k), attitude (n, 4) and
    place (n, 2), north and east of where the watch began, m."""
    axes, at = world(attitude), thrust.shape[1]
    out = np.zeros((len(nu), len(names_of(model)), 6))
    out[:, :at] = -thrust[:, :, None] * model.matrix.T
    for axis in (0, 1):
        out[:, at + axis] = _pushed_by(model, nu, NUDGE_M_S * axes[:, axis]) / NUDGE_M_S
    at += 2
    out[:, at : at + 3, :3] = axes
    at += 3
    out[:, at, :3] = -np.einsum("na,nai->ni", places, axes[:, :2])
    at += 1
    for place, dof in enumerate(DRAGGED):
        out[:, at + place, dof] = -np.abs(nu[:, dof]) * nu[:, dof]
    return out


def _pushed_by(model: Model, nu: Array, water: Array) -> Array:
    """Force (n, 6) that a model of the velocity over ground misses if the water moves by (n, 3), body axes: drag,
    Coriolis forces, and inertia of the turning body."""
    through = nu.copy()
    through[:, :3] -= water
    mass = model.mass.tolist()
    turned = np.stack(
        [a - b for a, b in zip(coriolis(mass, tuple(nu.T)), coriolis(mass, tuple(through.T)), strict=True)]
    ).T
    drag = model.damping * (nu - through)
    drag += model.quadratic * (np.abs(nu) * nu - np.abs(through) * through)
    out = turned + drag
    out[:, :3] -= model.mass[:3] * np.cross(nu[:, 3:], water)
    return np.asarray(out)


def world(attitude: Array) -> Array:
    """Unit vectors north, east, down (n, 3, 3) in body axes."""
    w, x, y, z = (attitude / np.linalg.norm(attitude, axis=1)[:, None]).T
    rows = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ]
    return np.stack([np.stack(row, axis=1) for row in rows], axis=1)
