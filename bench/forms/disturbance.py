"""A learnt disturbance and its prior: a first-order Gauss-Markov acceleration on every axis."""

from dataclasses import dataclass
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray
from scipy.signal import lfilter
from torch import Tensor

from bench.forms.task import STEP_S, Task

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Disturbance:
    """The disturbance of a task at K instants, `every` so many steps, linear in between; (K, n), m/s2, rad/s2."""

    task: Task
    every: int

    @property
    def instants(self) -> int:
        """K, the number of instants."""
        return -(-self.task.steps // self.every) + 1

    @property
    def kept(self) -> Tensor:
        """Factor (n,) by which the disturbance decays from one instant to the next."""
        return torch.exp(-self.every * STEP_S / self.task.disturbance_time_s)

    def roughness(self, slow: Tensor) -> Tensor:
        """Half the sum of its squared innovations, each over its standard deviation."""
        share = slow / self.task.disturbance_std
        steps = (share[1:] - self.kept * share[:-1]) / (1 - self.kept**2).sqrt()
        return 0.5 * (share[0].square().sum() + steps.square().sum())

    def coloured(self, white: Tensor) -> Tensor:
        """The disturbance with the normalised innovations `white` (K, n)."""
        slow = _Coloured.apply(white, self.kept)  # type: ignore[no-untyped-call]
        assert isinstance(slow, Tensor)
        return slow * self.task.disturbance_std

    def at_halves(self, slow: Tensor) -> Tensor:
        """The disturbance (2 N + 1, n) at the task's instants and halfway."""
        place = torch.arange(2 * self.task.steps + 1, dtype=torch.float64) / (2 * self.every)
        before = place.floor().long().clamp_max(len(slow) - 2)
        share = (place - before)[:, None]
        return slow[before] * (1 - share) + slow[before + 1] * share


class _Coloured(torch.autograd.Function):
    """White numbers (K, n) through x_k+1 = keep x_k + sqrt(1 - keep^2) e_k+1, x_0 = e_0."""

    @staticmethod
    def forward(ctx: Any, white: Tensor, keep: Tensor) -> Tensor:
        ctx.keep = keep.numpy()
        scaled = white.detach().numpy().copy()
        scaled[1:] *= np.sqrt(1 - ctx.keep**2)
        return torch.from_numpy(_recursive(scaled, ctx.keep))

    @staticmethod
    def backward(ctx: Any, *pulls: Any) -> tuple[Tensor, None]:
        back = _recursive(pulls[0].numpy()[::-1], ctx.keep)[::-1].copy()
        back[1:] *= np.sqrt(1 - ctx.keep**2)
        return torch.from_numpy(back), None


def _recursive(values: Array, keep: Array) -> Array:
    return np.stack([lfilter([1.0], [1.0, -k], values[:, i]) for i, k in enumerate(keep)], axis=1)
