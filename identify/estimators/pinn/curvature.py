"""How the loss curves in coefficients and noise levels together: Newton's steps, and intervals that own up to both."""

import torch
from torch import Tensor

from identify.estimators.pinn.equations import Equations, equations
from identify.estimators.pinn.network import Data, Raw
from identify.estimators.pinn.noise import Noise, of_logarithm, slope

PROBE = 0.01
LEAST_EIGENVALUE = 0.02
"""Of the curvature scaled to a unit diagonal: a flatter direction is taken to be this flat, uncertain but bounded."""


def curvature_of(
    data: Data, map_: Raw, raw: Tensor, at: Equations, noise: Noise, start: Noise, spread: Tensor
) -> Tensor:
    """Second derivatives of half the loss in raw parameters and logarithms of noise levels, made positive definite.

    Between axes the information of the equations serves. What belongs to one axis (mass, damping, noise levels) is
    measured: one of every axis is probed at once, and what the others' answer to that is known to be taken off.
    """
    step_s, n, count = data.interval.step_s, data.axes, len(raw)
    dofs = list(data.interval.dofs)
    each = list(range(n))
    sensors = data.channel_axis.tolist()
    owner = torch.tensor([*dofs, *dofs, *(dofs[a] for a in (*sensors, *each, *each))], device=raw.device)
    place = torch.tensor(
        [*dofs, *range(6, 6 + n), *range(count, count + len(sensors) + 2 * n)], device=raw.device
    )
    rank = torch.tensor([int((owner[:i] == owner[i]).sum()) for i in range(len(owner))], device=raw.device)
    size = count + len(sensors) + 2 * n
    out = torch.zeros(size, size, dtype=raw.dtype, device=raw.device)
    out[:count, :count] = at.information + at.prior
    known = out.clone()
    here = torch.cat([at.gradient, slope(at.moments, step_s, noise, start, spread)])
    for turn in range(int(rank.max()) + 1):
        probed = place[rank == turn]
        push = torch.zeros(size, dtype=raw.dtype, device=raw.device)
        push[probed] = PROBE
        moved = of_logarithm(noise.logarithm() + push[count:], n)
        to = raw + push[:count]
        there = equations(data, map_, to, at.state - at.leaning @ push[:count], moved)
        answer = (torch.cat([there.gradient, slope(there.moments, step_s, moved, start, spread)]) - here) / PROBE
        for column in probed:
            mine = place[owner == owner[place == column]]
            others = probed[probed != column]
            out[mine, column] = answer[mine] - known[mine][:, others].sum(dim=1)
    out = 0.5 * (out + out.mT)
    scale = out.diagonal().abs().clamp_min(1e-12).sqrt()
    value, vector = torch.linalg.eigh(out / scale[:, None] / scale)
    out = (vector * value.abs().clamp_min(LEAST_EIGENVALUE)) @ vector.mT
    return out * scale[:, None] * scale


