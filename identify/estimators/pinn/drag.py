"""Is a drag missing that grows as the speed squared? Asked of the trained network, without training another.

The Lagrange-multiplier test (Engle 1984, eq. 13): the slope of the loss in the missing coefficient at zero, over the
root of its information once weights and coefficients are projected out.
"""

from dataclasses import dataclass

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from identify.estimators.pinn.equations import eliminated, entangled, stepped
from identify.estimators.pinn.leaning import by_raw
from identify.estimators.pinn.network import Data, Pull, between, pull
from identify.estimators.pinn.physics import Balance
from identify.estimators.pinn.raw import Raw
from identify.estimators.pinn.stretches import Stretch, stretches, worked
from identify.estimators.pinn.training import Trained


@dataclass(frozen=True)
class Missing:
    """score (n,): by how many standard errors each axis's quadratic drag differs from none. shift (n, p): what the
    raw parameters would change by with that one in."""

    score: NDArray[np.float64]
    shift: NDArray[np.float64]


def missing_drag(data: Data, map_: Raw, trained: Trained) -> Missing:
    """Of every fitted axis."""
    raw, noise, n = trained.point.raw, trained.point.noise, data.axes
    settled = trained.point.equations
    state, on, beside = settled.state, settled.on, settled.beside
    each = torch.arange(n, device=state.device)

    def columns(some: Data, near: Tensor, pulled: Pull) -> Tensor:
        rows = torch.zeros(*pulled.residual.shape, n, dtype=state.dtype, device=state.device)
        rows[:, each, each] = _squares(some, pulled.balance) / pulled.std[:, :n]
        return torch.cat([pulled.residual[:, :, None], by_raw(some, map_, raw, near, pulled), rows], dim=2)

    found = eliminated(data, map_, raw, state, noise, columns)

    def traced(some: Stretch) -> Tensor:
        part = between(data, some.intervals)
        pulled = pull(part, map_, raw, state[some.nodes], noise)
        before, after = entangled(pulled.balance, on[some.nodes], beside[some.intervals], n)
        inverse = torch.linalg.inv(stepped(pulled, n)[0])
        grows = part.interval.step_s[:, None] * pulled.balance.mean[:, list(data.interval.dofs)].abs()
        spread = (before + after)[:, each, each] / pulled.std[:, :n] ** 2
        told: Tensor = (grows * (spread - inverse[:, each, each])).sum(dim=0)
        return told

    trace = torch.stack(worked(traced, stretches(len(beside), state.device))).sum(dim=0)
    size = 1 + len(raw)
    slope = found.square[0, size:] + trace
    cross, own_information = found.square[1:size, size:], found.square[size:, size:].diagonal()
    _, tilt = map_.prior(raw)
    lean = torch.linalg.solve(found.square[1:size, 1:size] + torch.diag(tilt**2), cross)
    left = (own_information - (cross * lean).sum(dim=0)).clamp_min(1e-12)
    return Missing((-slope / left.sqrt()).cpu().numpy(), (lean * (slope / left)).mT.cpu().numpy())


def _squares(data: Data, own: Balance) -> Tensor:
    """What a drag of 1 N per (m/s)^2 takes in each interval from the momentum of the fitted axes, (N, n)."""
    speed = own.mean[:, list(data.interval.dofs)]
    return data.interval.step_s[:, None] * speed * speed.abs()
