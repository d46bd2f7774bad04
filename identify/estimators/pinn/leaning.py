"""Slopes of the residuals of a pull in the raw parameters."""

import torch
from torch import Tensor

from identify.estimators.pinn.network import Data, Pull
from identify.estimators.pinn.physics import bending, by_coefficients
from identify.estimators.pinn.raw import Raw


def by_raw(data: Data, map_: Raw, raw: Tensor, state: Tensor, pulled: Pull) -> Tensor:
    """Slopes (N, R, p) of the residuals `pulled` at `raw` and `state` in the raw parameters, with fixed variances."""
    known, n, width = data.interval, data.axes, state.shape[1]
    given, slope, owner = map_.coefficients(raw), map_.slope(raw), pulled.owner
    out = torch.zeros(*pulled.residual.shape, len(raw), dtype=state.dtype, device=state.device)
    out[:, :n] = by_coefficients(known, given, state, pulled.balance) * slope
    # Positions and readings depend on mass: the velocity swings under the thrust and bends under the disturbance.
    h = known.step_s[:, None].expand(-1, pulled.positions)
    rows = torch.arange(2 * n, len(owner), device=state.device)
    axis = owner[rows]
    dof = torch.tensor(known.dofs, device=state.device)[axis]
    mass = given.mass[dof]
    bent = torch.cat([-(h**2) / 12, data.bent], dim=1) / mass
    swung = torch.cat([-0.5 * h, data.swung], dim=1) * known.swing[:, axis] / mass
    change = state[1:] - state[:-1]
    in_mass = swung - bent * (change @ bending(known, given.damping, width)[axis].mT)
    out[:, rows, dof] = -in_mass / mass * slope[dof]
    out[:, rows, 6 + axis] = bent * change[:, axis] * slope[6 + axis]
    return out * (pulled.known / pulled.std)[:, :, None]
