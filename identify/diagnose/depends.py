"""What a missing force goes with: of all generic forces, those that it is most alike, one after another."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from bridge.effects.course import Course
from bridge.vehicle.coefficients import DOFS
from identify.diagnose.diagnosis import Dependence
from identify.diagnose.generic import Parity, Variable, of_other_speeds, unit_forces
from identify.diagnose.missing import Missing

Array = NDArray[np.float64]

MOST, LEAST_STRENGTH = 3, 0.05

AS_GOOD = 0.97
"""Of forces that take up almost as much as the best, the plainest is told: the order is that of `generic`."""


def depends_on(missing: Missing, course: Course, every: int) -> tuple[Dependence, ...]:
    """What each degree of freedom's missing force goes with, strongest first; strength is the share of its power
    beyond what masses, a linear damping and a constant take up, times its share of all the missing power."""
    power = missing.power.sum(axis=0)
    if not power.any():
        return ()
    fitted = np.flatnonzero(power > 0.05 * power.sum()).tolist()
    forces = [(v, p, f[::every]) for v, p, f in unit_forces(course, list(range(6)))]
    out = []
    for dof in fitted:
        force = missing.wrench[:, dof]
        if not force.any():
            force = missing.wrong[:, dof]
        plain = np.column_stack([np.ones(len(force)), course.nu[::every, dof], course.nu_dot[::every, dof]])
        others = of_other_speeds(course, [k for k in range(6) if k != dof])
        out += _of_axis(dof, force, plain, [*((v, p, f[::every]) for v, p, f in others), *forces])
    return tuple(sorted(out, key=lambda one: -one.strength))


def _of_axis(
    dof: int, force: Array, plain: Array, forces: Sequence[tuple[Variable, Parity | None, Array]]
) -> list[Dependence]:
    base, _ = np.linalg.qr(plain)

    def beyond(value: Array) -> Array:
        return np.asarray(value - base @ (base.T @ value))

    left = beyond(force)
    whole = float(left @ left)
    columns = np.column_stack([beyond(one) for _, _, one in forces])
    length = np.sqrt(np.sum(columns**2, axis=0))
    told = length > 1e-3 * np.sqrt(len(force))
    columns = columns / np.where(told, length, 1.0)
    out: dict[Variable, Dependence] = {}
    for _ in range(MOST):
        along = np.where(told, columns.T @ left, 0.0)
        best = int(np.argmax(along**2 >= AS_GOOD * np.max(along**2)))
        share = float(along[best] ** 2) / max(whole, 1e-300)
        if share < LEAST_STRENGTH:
            break
        variable, parity, _ = forces[best]
        if variable not in out:
            out[variable] = Dependence(DOFS[dof], variable, parity, min(share, 1.0))
        left = left - along[best] * columns[:, best]
    return list(out.values())
