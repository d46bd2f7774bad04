"""Velocities without their white noise, for the forces that are products of velocities.

A smoothing spline's equivalent filter, 1 / (1 + (f / f_c)^4) (Silverman 1984), runs over a uniform grid. The corner
f_c minimises generalised cross-validation (Craven and Wahba 1979), so each signal is smoothed according to its own
noise: a noisy sway velocity a lot, a clean gyro hardly.
"""

import numpy as np
from numpy.typing import NDArray

from identify.dive import Dive, Signal

Array = NDArray[np.float64]

CORNERS = 40
LOWEST_HZ = 0.02
FEWEST = 8


def smoothed_velocity(dive: Dive, time_s: Array) -> Array:
    """nu at the times (m,), (m, 6); 0 where nothing was measured."""
    out = np.zeros((len(time_s), 6))
    velocity = dive.velocity
    if velocity is not None and dive.velocity_smoothing_s > 0:
        velocity = Signal(velocity.time_s - dive.velocity_smoothing_s, velocity.value)
    for signal, column, dof in (
        *((velocity, i, i) for i in range(3)),
        *((dive.gyro, i, 3 + i) for i in range(3)),
        (dive.fog, 0, 5),
    ):
        if signal is not None and len(signal) >= FEWEST:
            out[:, dof] = smoothed(signal, column, time_s)
    return out


def smoothed(signal: Signal, column: int, time_s: Array) -> Array:
    """A column of a signal without its white noise, at the times (m,); 0 if it has no finite sample."""
    start, end = float(signal.time_s[0]), float(signal.time_s[-1])
    grid = np.linspace(start, end, max(round((end - start) * signal.rate_hz) + 1, 2))
    values = np.nan_to_num(Signal(signal.time_s, signal.value[:, column : column + 1]).at(grid)[:, 0])
    spacing = grid[1] - grid[0]
    # Mirrored once, so that the ends meet.
    spectrum = np.fft.rfft(np.concatenate([values, values[::-1]]))
    frequency = np.fft.rfftfreq(2 * len(values), spacing)
    power = np.abs(spectrum) ** 2
    corners = np.geomspace(LOWEST_HZ, 0.5 / spacing, CORNERS)
    filters = 1.0 / (1.0 + (frequency[None, :] / corners[:, None]) ** 4)
    left = ((1.0 - filters) ** 2) @ power
    best = int(np.argmin(left / np.mean(1.0 - filters, axis=1) ** 2))
    smooth = np.fft.irfft(spectrum * filters[best], 2 * len(values))[: len(values)]
    result: Array = np.interp(time_s, grid, smooth)
    return result
