"""Loss terms that all forms share: Fossen's equations, the coefficients' priors, the readings."""

import numpy as np
import torch
from torch import Tensor, nn
from torch.nn.functional import softplus

from bench.forms.task import STEP_S, Task
from bridge.vehicle.dynamics import acceleration

UNDER_ONE = float(np.log(np.expm1(1.0)))
"""Softplus is 1 at this argument."""

FINE = 0.01
"""Change of a raw parameter per unit of the trained parameter: the readings resolve coefficients about this finely."""

SPREAD = 1.0
"""Standard deviation of the logarithm of a mass or damping about its initial value: next to nothing is known."""


class Coefficients(nn.Module):
    """Masses (6,), dampings (n,) and trims (n,) of a task; softplus keeps all but the trims positive.

    The trained parameters are scaled so that a step of 1 is about 1 %.
    """

    def __init__(self, task: Task) -> None:
        super().__init__()
        n = len(task.dofs)
        self._task = task
        self.fine_mass = nn.Parameter(torch.zeros(6, dtype=torch.float64))
        self.fine_damping = nn.Parameter(torch.zeros(n, dtype=torch.float64))
        self.fine_trim = nn.Parameter(torch.zeros(n, dtype=torch.float64))

    @property
    def mass(self) -> Tensor:
        return self._task.mass * softplus(UNDER_ONE + FINE * self.fine_mass)

    @property
    def damping(self) -> Tensor:
        return self._task.damping * softplus(UNDER_ONE + FINE * self.fine_damping)

    @property
    def trim(self) -> Tensor:
        return self._task.trim * FINE * self.fine_trim

    def prior(self) -> Tensor:
        """Half the sum of squared logarithms of masses and dampings and of trims, each over its spread."""
        ratios = torch.cat([self.mass / self._task.mass, self.damping / self._task.damping])
        trims = FINE * self.fine_trim
        return 0.5 * (ratios.log() / SPREAD).square().sum() + 0.5 * trims.square().sum()

    def drive(self, disturbance: Tensor) -> Tensor:
        """Total force (2 N + 1, n): thrust less restoring force, trim, and a `disturbance` given as acceleration."""
        return self._task.force + self.trim + self.mass[list(self._task.dofs)] * disturbance


def accelerations(task: Task, given: Coefficients, nu: Tensor, drive: Tensor, others: Tensor) -> Tensor:
    """Acceleration nu_dot (k, n) of the fitted axes at nu (k, n) under drive (k, n), with velocities others (k, 6)."""
    motion, tau = list(others.unbind(1)), list(torch.zeros_like(others).unbind(1))
    damping: list[Tensor | float] = [0.0] * 6
    for axis, dof in enumerate(task.dofs):
        motion[dof], tau[dof], damping[dof] = nu[:, axis], drive[:, axis], given.damping[axis]
    rate = acceleration(given.mass.unbind(), damping, motion, tau, [0.0] * 6)
    return torch.stack([rate[dof] for dof in task.dofs], dim=1)


def misfit(task: Task, nu: Tensor, rate: Tensor, finest: float = 0.0) -> Tensor:
    """Half the sum of squared errors of all readings, each over its standard deviation.

    nu, rate (N + 1, n): velocity and acceleration at the instants. `finest`: lower limit of a velocity's standard
    deviation, for a form that can't be as fine as the best sensor.
    """
    read = task.instants
    k, a, w = read.step, read.axis, read.weight
    at = w[:, 0] * nu[k, a] + w[:, 1] * rate[k, a] + w[:, 2] * nu[k + 1, a] + w[:, 3] * rate[k + 1, a]
    total = ((at - read.value) / read.std.clamp_min(finest)).square().sum()
    if task.means is None and task.depths is None:
        return 0.5 * total
    mean = 0.5 * (nu[1:] + nu[:-1]) + STEP_S / 12 * (rate[:-1] - rate[1:])
    if (means := task.means) is not None:
        of_axis = mean[:, means.axis]
        pair = 0.5 * (of_axis[means.step] + of_axis[means.step + 1])
        total = total + ((pair - means.value) / max(means.std, finest)).square().sum()
    if (depths := task.depths) is not None:
        sunk = torch.cat([mean.new_zeros(1), STEP_S * (depths.down * mean).sum(dim=1).cumsum(dim=0)])
        error = sunk[depths.at] - depths.value
        # The first depth is free: its best value is the mean error.
        total = total + ((error - error.mean()) / depths.std).square().sum()
    return 0.5 * total
