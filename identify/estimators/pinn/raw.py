"""Maps the raw parameters that are trained to coefficients, with the priors of the coefficients."""

from dataclasses import dataclass

import numpy as np
import torch
from torch import Tensor

from bridge.vehicle.config import Configuration
from identify.estimators.likelihood_axis import (
    DAMPING_RATIO,
    MASS_RATIO,
    PRIOR_STD,
    TRIM_SHARE,
    UNMEASURED_SHARE,
    rigid_mass,
)
from identify.estimators.pinn.physics import Coefficients


@dataclass(frozen=True)
class Raw:
    """Map from raw parameters (6 + 2 n,) to coefficients: six masses, n dampings, n trims.

    A mass or a damping is `scale` softplus(raw), a trim `scale` raw. The priors are log-normal of `spread` about
    `middle`, normal for trims. scale, middle, spread (6 + 2 n,); `axes` is n.
    """

    scale: Tensor
    middle: Tensor
    spread: Tensor
    axes: int

    def values(self, raw: Tensor) -> Tensor:
        """Masses, dampings and trims, SI units."""
        soft = torch.nn.functional.softplus(raw)
        return self.scale * torch.where(self._positive(raw), soft, raw)

    def slope(self, raw: Tensor) -> Tensor:
        """Slope of the values in the raw parameters, (6 + 2 n,)."""
        return self.scale * torch.where(self._positive(raw), torch.sigmoid(raw), torch.ones_like(raw))

    def to_logarithm(self, raw: Tensor) -> Tensor:
        """Slope of each value's logarithm in its raw parameter; for a trim, of the trim itself."""
        slope = self.slope(raw)
        return torch.where(self._positive(raw), slope / self.values(raw), slope)

    def raw(self, values: Tensor) -> Tensor:
        """The inverse of `values`."""
        ratio = values / self.scale
        return torch.where(self._positive(ratio), torch.log(torch.expm1(ratio.clamp_min(1e-6))), ratio)

    def coefficients(self, raw: Tensor) -> Coefficients:
        values = self.values(raw)
        return Coefficients(values[:6], values[6 : 6 + self.axes], values[6 + self.axes :])

    def prior(self, raw: Tensor) -> tuple[Tensor, Tensor]:
        """The priors' residuals over their spreads (6 + 2 n,), and the residuals' slopes."""
        values, slope = self.values(raw), self.slope(raw)
        positive = self._positive(raw)
        residual = torch.where(positive, (values / self.middle.clamp_min(1e-12)).log(), values - self.middle)
        return residual / self.spread, torch.where(positive, slope / values, slope) / self.spread

    def _positive(self, like: Tensor) -> Tensor:
        return torch.arange(len(like), device=like.device) < 6 + self.axes


def raw_of(shape: Configuration, dofs: tuple[int, ...], device: torch.device) -> Raw:
    """Return the map and priors for a vehicle's shape with fitted axes `dofs`; the priors are the likelihood's own."""
    rigid = np.array([rigid_mass(shape, dof) for dof in range(6)])
    fitted = rigid[list(dofs)]
    trim = np.array(
        [max(TRIM_SHARE * shape.thruster_limit_n * (1.0 if dof < 3 else 0.2), 1e-3) for dof in dofs]
    )
    mass_spread = [PRIOR_STD[0] if dof in dofs else UNMEASURED_SHARE / MASS_RATIO for dof in range(6)]
    scale = np.concatenate([rigid, DAMPING_RATIO * fitted, trim])
    middle = np.concatenate([MASS_RATIO * rigid, DAMPING_RATIO * fitted, np.zeros(len(dofs))])
    spread = np.concatenate([mass_spread, [PRIOR_STD[1]] * len(dofs), trim])
    tensors = [torch.as_tensor(part, device=device) for part in (scale, middle, spread)]
    return Raw(tensors[0], tensors[1], tensors[2], len(dofs))
