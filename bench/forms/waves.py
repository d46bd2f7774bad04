"""A network of time: sines and cosines (Tancik et al. 2020), two hidden layers, and its derivative.

The first layer of such a network is a Fourier series for each of its units. On even instants it is one inverse FFT: a
hundred times cheaper than the product of the features with the weights, with the same result.
"""

import math

import torch
from scipy.fft import next_fast_len
from torch import Tensor, nn


class Waves(nn.Module):
    """`outputs` functions of time, of order 1, at even instants 0, 1 .. `steps`, `step_s` apart.

    Waves go up to `highest_hz`, with a period of about twice the whole. Above an output's `corner_hz` (outputs,), the
    initial size and the learning rate of a wave fall with its frequency to the power `fall`; the waves of the hidden
    layers likewise, above the mean corner. The output starts at 0, or at the values given to `begin_at`.
    """

    def __init__(
        self,
        steps: int,
        step_s: float,
        highest_hz: float,
        corner_hz: Tensor,
        fall: float,
        width: int,
    ) -> None:
        super().__init__()
        self._points, self._period = steps + 1, next_fast_len(2 * steps + 2)
        count = min(int(highest_hz * self._period * step_s), steps)
        frequency_hz = torch.arange(count + 1, dtype=torch.float64) / (self._period * step_s)
        self._omega = 2 * math.pi * frequency_hz
        outputs = len(corner_hz)
        corners_hz = torch.cat([corner_hz, corner_hz.mean().expand(width)])[:, None]
        gain = (1 + (frequency_hz / corners_hz) ** 2) ** (-0.5 * fall)
        self._gain = 0.5 * gain / gain.square().sum(dim=1, keepdim=True).sqrt()
        self.straight = nn.Parameter(torch.zeros(outputs, count + 1, 2, dtype=torch.float64))
        self.first = nn.Parameter(torch.randn(width, count + 1, 2, dtype=torch.float64))
        self.second = nn.Linear(width, width, dtype=torch.float64)
        self.last = nn.Linear(width, outputs, dtype=torch.float64)
        nn.init.zeros_(self.last.weight)
        nn.init.zeros_(self.last.bias)

    def forward(self) -> tuple[Tensor, Tensor]:
        """Values and time derivatives, (steps + 1, outputs) each."""
        value, slope = self._series(torch.cat([self.straight, self.first]))
        outputs = len(self.straight)
        a = torch.tanh(value[:, outputs:])
        a_slope = (1 - a**2) * slope[:, outputs:]
        b = torch.tanh(self.second(a))
        b_slope = (1 - b**2) * (a_slope @ self.second.weight.mT)
        straight, straight_slope = value[:, :outputs], slope[:, :outputs]
        return straight + self.last(b), straight_slope + b_slope @ self.last.weight.mT

    def begin_at(self, values: Tensor) -> None:
        """Start at values (steps + 1, outputs), as closely as the waves allow."""
        mirrored = torch.cat([values, values.flip(0), values[:1].expand(self._period - 2 * self._points, -1)])
        waves = torch.fft.rfft(mirrored, dim=0, norm="forward")[: len(self._omega)].mT
        waves = waves / self._gain[: len(self.straight)]
        with torch.no_grad():
            self.straight.copy_(torch.view_as_real(waves))

    def _series(self, weights: Tensor) -> tuple[Tensor, Tensor]:
        """Fourier series (steps + 1, k) of weights (k, count + 1, 2) and their derivatives."""
        waves = torch.view_as_complex(weights) * self._gain
        spectra = torch.cat([waves, 1j * self._omega * waves])
        points = torch.fft.irfft(spectra, self._period, norm="forward")[:, : self._points]
        return points[: len(weights)].mT, points[len(weights) :].mT
