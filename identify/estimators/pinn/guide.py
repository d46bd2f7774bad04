"""Knowledge of each axis's own filter, in the network's parameters: start of training, and curvature of the loss."""

from dataclasses import dataclass

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from identify.estimators.pinn.noise import Noise
from identify.estimators.pinn.raw import Raw
from identify.estimators.pinn.start import Filters, Levels
from identify.estimators.pinn.training import Point

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Guide:
    """The filters of the fitted axes `dofs`, ascending, in the network's parameters. `share` (C,): intervals read per
    reading, for each channel."""

    dofs: tuple[int, ...]
    map_: Raw
    filters: Filters
    share: Tensor

    def start(self) -> tuple[Tensor, Noise]:
        """Raw parameters and noise levels at which the filters start the network."""
        begin, middle = self.filters.start, self.map_.middle

        def tensor(values: object) -> Tensor:
            return torch.as_tensor(values, dtype=middle.dtype, device=middle.device)

        values = middle.clone()
        values[list(self.dofs)] = tensor(begin.mass)
        values[6:] = tensor(np.concatenate([begin.damping, begin.trim]))
        levels = (begin.sensor, begin.disturbance, begin.time_constant_s)
        return self.map_.raw(values), Noise(*map(tensor, levels))

    def curvature(self, point: Point) -> Tensor:
        """Curvature of half the loss without priors, ordered as `Point.where`: from the filters, and from the
        network's own equations for masses that are not fitted."""
        like, noise, count, n = point.raw, point.noise, len(point.raw), len(self.dofs)
        by_filters = self.filters.curvature(self._levels(like, noise))
        # In the network's order the sensors come before the disturbances.
        sensors = len(noise.sensor)
        place = [
            *self.dofs,
            *range(6, count),
            *range(count + sensors, count + sensors + 2 * n),
            *range(count, count + sensors),
        ]
        # A sensor's noise shows in the means of intervals, which are fewer than the readings of a filter.
        ones = torch.ones(2 * n, dtype=like.dtype, device=like.device)
        unit = torch.cat([self.map_.to_logarithm(like), self.share.sqrt(), ones])[place]
        out = torch.zeros(len(point.slope), len(point.slope), dtype=like.dtype, device=like.device)
        others = [dof for dof in range(6) if dof not in self.dofs]
        out[np.ix_(others, others)] = point.equations.information[np.ix_(others, others)]
        out[np.ix_(place, place)] = torch.as_tensor(by_filters, device=like.device) * torch.outer(unit, unit)
        return out

    def near(self, raw: Tensor, noise: Noise) -> Filters:
        """See `Filters.near`."""
        return self.filters.near(self._levels(raw, noise))

    def _levels(self, raw: Tensor, noise: Noise) -> Levels:
        values, n = self.map_.values(raw), len(self.dofs)
        parts = (values[list(self.dofs)], values[6 : 6 + n], values[6 + n :])
        levels = (noise.disturbance, noise.time_constant_s, noise.sensor)
        return Levels(*(part.cpu().numpy() for part in (*parts, *levels)))
