"""Physics of the source paper's loss, tau_pred = M v_dot + C(v) v + D v + g, and its minimum in closed form.

tau_pred is linear in the parameters, and neither the network nor its output enters it. So training tends to the
parameters of a least-squares fit bounded below by zero, whatever the network does.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import lsq_linear

from bridge.vehicle.coefficients import BY_NAME, DAMPINGS, DOFS, MASSES
from bridge.vehicle.config import Configuration
from bridge.vehicle.dynamics import coriolis, restoring
from identify.dive import Array
from identify.filters import AlignedDive

PAPER_DOFS = (0, 1, 5)
DAMPING_START = 1.0
LEAST_RMS = {0: (0.02, 1.0), 1: (0.02, 1.0), 5: (0.02, 0.2)}  # velocity (m/s, rad/s) and wrench (N, N m)


@dataclass(frozen=True)
class Samples:
    """Inputs of the physical loss: `nu`, `nu_dot`, `tau`, `g`, all (n, 6), of which the loss uses the axes `dofs`."""

    nu: Array
    nu_dot: Array
    tau: Array
    g: Array
    dofs: tuple[int, ...]

    @property
    def names(self) -> tuple[str, ...]:
        """The parameters: masses of the axes, then dampings."""
        return tuple(MASSES[d].name for d in self.dofs) + tuple(DAMPINGS[d].name for d in self.dofs)


def excited(dive: AlignedDive) -> tuple[dict[int, str], tuple[int, ...]]:
    """Reasons why axes can't be learnt, by axis, and the axes that can be: those of surge, sway and yaw that moved."""
    reasons = {}
    for dof in range(6):
        if dof not in PAPER_DOFS:
            reasons[dof] = "the paper's method learns surge, sway and yaw alone"
        elif not dive.has[dof]:
            reasons[dof] = f"no velocity in {DOFS[dof]} is recorded"
        else:
            moved, pushed = (_rms(a[dive.valid, dof]) for a in (dive.nu, dive.tau))
            least_moved, least_pushed = LEAST_RMS[dof]
            if moved < least_moved or pushed < least_pushed:
                reasons[dof] = f"{DOFS[dof]} was not excited in this dive"
    return reasons, tuple(dof for dof in PAPER_DOFS if dof not in reasons)


def samples(
    dive: AlignedDive, rows: NDArray[np.intp], configuration: Configuration, dofs: Sequence[int]
) -> Samples:
    """The rows of an aligned dive that the loss uses."""
    g = np.column_stack(
        [np.broadcast_to(x, len(rows)) for x in restoring(configuration, list(dive.attitude[rows].T))]
    )
    return Samples(dive.nu[rows], dive.nu_dot[rows], dive.tau[rows], g, tuple(dofs))


def starting_values(configuration: Configuration, dofs: Sequence[int]) -> dict[str, float]:
    """Start values: masses at the rigid body's (the paper: at the dry mass), dampings at 1."""
    masses = {MASSES[d].name: _rigid_body(configuration)[d] for d in dofs}
    return masses | {DAMPINGS[d].name: DAMPING_START for d in dofs}


def fixed_values(configuration: Configuration) -> dict[str, float]:
    """All twelve coefficients before learning: from the vehicle file's model, otherwise the rigid body's mass and no
    damping."""
    rigid = _rigid_body(configuration)
    return {c.name: rigid[c.dof] if c.kind == "mass" else 0.0 for c in BY_NAME.values()} | configuration.model


def predicted_wrench(
    values: Mapping[str, Any], nu_dot: Sequence[Any], nu: Sequence[Any], g: Sequence[Any]
) -> tuple[Any, ...]:
    """tau_pred of the six axes, for arrays or tensors; `values` holds all twelve coefficients by name."""
    mass = [values[c.name] for c in MASSES]
    damping = [values[c.name] for c in DAMPINGS]
    c = coriolis(mass, nu)
    return tuple(mass[i] * nu_dot[i] + c[i] + damping[i] * nu[i] + g[i] for i in range(6))


def closed_form(data: Samples, fixed: Mapping[str, float]) -> dict[str, float]:
    """The parameters that minimise the physical loss with every parameter at or above zero (`lsq_linear`)."""

    def stacked(values: Mapping[str, float]) -> Array:
        wrench = predicted_wrench(values, list(data.nu_dot.T), list(data.nu.T), list(data.g.T))
        return np.concatenate([np.broadcast_to(wrench[dof], len(data.nu)) for dof in data.dofs])

    none = stacked({**fixed, **dict.fromkeys(data.names, 0.0)})
    columns = [stacked({**fixed, **dict.fromkeys(data.names, 0.0), name: 1.0}) - none for name in data.names]
    target = np.concatenate([data.tau[:, dof] for dof in data.dofs]) - none
    fit = lsq_linear(np.column_stack(columns), target, bounds=(0.0, np.inf), method="bvls")
    return dict(zip(data.names, (float(x) for x in fit.x), strict=True))


def _rigid_body(configuration: Configuration) -> tuple[float, ...]:
    return (configuration.dry_mass_kg,) * 3 + configuration.inertia_kgm2


def _rms(value: Array) -> float:
    return float(np.sqrt(np.mean(value**2))) if len(value) else 0.0
