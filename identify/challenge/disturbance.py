"""Coloured noise: the random disturbance of a vehicle that no effect explains."""

import numpy as np
from numba import njit
from numpy.typing import NDArray

Array = NDArray[np.float64]


@njit(cache=True)
def _kept(white: Array, keep: float) -> None:
    fresh = np.sqrt(1.0 - keep * keep)
    for i in range(1, len(white)):
        for j in range(white.shape[1]):
            white[i, j] = keep * white[i - 1, j] + fresh * white[i, j]


def coloured(
    rng: np.random.Generator, steps: int, step_s: float, time_constant_s: float, poles: int, std: Array
) -> Array:
    """Gauss-Markov noise (steps, k) with one pole, or with two equal poles of the same mean memory."""
    out = rng.standard_normal((steps, len(std)))
    keep = float(np.exp(-step_s * poles / time_constant_s))
    for _ in range(poles):
        _kept(out, keep)
    if poles == 2:
        # Two equal poles in a row have a variance of (1 + k^2) / (1 - k^2).
        out *= np.sqrt((1 - keep**2) / (1 + keep**2))
    return np.asarray(out * std)
