"""The velocity estimate of the autopilot's filter, late, smooth and noisy, and the position by dead reckoning from
it."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.signal import lfilter

from identify.challenge.site import coloured

Array = NDArray[np.float64]


@dataclass(frozen=True)
class VelocityFilter:
    """late_s: age of its readings; smooth_s: time constant of a first-order smoothing; noise_m_s: standard deviation
    of its error along each axis, with a correlation time of `memory_s`."""

    late_s: float
    smooth_s: float
    noise_m_s: float
    memory_s: float


def draw_filter(rng: np.random.Generator) -> VelocityFilter:
    return VelocityFilter(
        rng.uniform(0.02, 0.12),
        rng.uniform(0.03, 0.2),
        float(np.exp(rng.uniform(np.log(0.005), np.log(0.025)))),
        float(np.exp(rng.uniform(np.log(0.5), np.log(3.0)))),
    )


def estimated(
    moving: Array, step_s: float, every: int, one: VelocityFilter, rng: np.random.Generator
) -> Array:
    """Estimated velocity (m, 3), m/s, at every `every` steps, from the true velocity (n, 3) at each step."""
    steps = np.arange(len(moving), dtype=np.float64)
    late = np.column_stack([np.interp(steps - one.late_s / step_s, steps, column) for column in moving.T])
    if one.smooth_s > 0:
        keep = float(np.exp(-step_s / one.smooth_s))
        late = lfilter([1.0 - keep], [1.0, -keep], late, axis=0, zi=keep * late[:1])[0]
    seen = late[::every]
    noise = coloured(rng, len(seen), every * step_s, one.memory_s, 1, np.full(3, one.noise_m_s))
    return np.asarray(seen + noise)


def reckoned(velocity: Array, tick_s: float) -> Array:
    """Position (m, 3), m, by dead reckoning on a velocity (m, 3), from its starting point."""
    between = 0.5 * (velocity[1:] + velocity[:-1]) * tick_s
    return np.concatenate([np.zeros((1, 3)), np.cumsum(between, axis=0)])
