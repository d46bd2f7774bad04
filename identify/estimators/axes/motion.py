"""Motion of a dive on a uniform grid: velocities, Coriolis forces, integrals, means; velocities smoothed for products.

The smoothing is a spline's equivalent filter, 1 / (1 + (f / f_c)^4) (Silverman 1984). The corner f_c minimises
generalised cross-validation (Craven and Wahba 1979), so each signal is smoothed by its own noise: a noisy sway velocity
a lot, a clean gyro hardly.
"""

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from bridge.arrays import Array
from bridge.vehicle.dynamics import coriolis
from identify.dive import Dive, Signal
from identify.threads import side_by_side


@dataclass(frozen=True)
class Motion:
    """Velocities `nu` (m, 6) at the uniform times `time_s` (m,), smoothed as their noise requires; breaks_s (r - 1,):
    times between the runs of a dive."""

    time_s: Array
    nu: Array
    breaks_s: Array = field(default_factory=lambda: np.zeros(0))

    @cached_property
    def coriolis(self) -> Array:
        """C(nu) nu in each degree of freedom for a unit of each mass, (6, 6, m); it is linear in the masses."""
        nu = tuple(self.nu.T)
        of_each = [coriolis(unit_mass, nu) for unit_mass in np.eye(6).tolist()]
        return np.stack([np.broadcast_arrays(*of_unit, nu[0])[:6] for of_unit in of_each], axis=1)

    def integral(self, values: Array) -> Array:
        """Integral of values at the times, (m,), by the trapezium rule."""
        steps = 0.5 * (values[1:] + values[:-1]) * np.diff(self.time_s)
        return np.concatenate([[0.0], np.cumsum(steps)])

    def interpolated(self, time_s: Array, values: Array) -> Array:
        """Values (n,) at the times (n,), interpolated at those of the motion (m,); constant beyond the ends of each
        run."""
        return interpolated(self.time_s, time_s, values, self.breaks_s)

    def mean_between(self, values: Array, start_s: Array, end_s: Array) -> Array:
        """Mean (n,) over each interval of values at the times, (m,); 0 for an empty interval."""
        total = self.integral(values)
        span_s = end_s - start_s
        area = np.interp(end_s, self.time_s, total) - np.interp(start_s, self.time_s, total)
        return np.asarray(np.where(span_s > 0, area / np.where(span_s > 0, span_s, 1.0), 0.0))


def interpolated(at_s: Array, time_s: Array, values: Array, breaks_s: Array) -> Array:
    """Linear interpolation (m,) of values (n,) at rising times, constant beyond the ends of each run between breaks.

    0 in a run that holds no value.
    """
    if not len(breaks_s):
        return np.asarray(np.interp(at_s, time_s, values))
    out, cut, known = np.zeros(len(at_s)), np.searchsorted(at_s, breaks_s), np.searchsorted(time_s, breaks_s)
    runs = zip(
        *(np.split(series, cut) for series in (np.arange(len(at_s)), at_s)),
        *(np.split(series, known) for series in (time_s, values)),
        strict=True,
    )
    for rows, asked_s, read_s, read in runs:
        if len(read):
            out[rows] = np.interp(asked_s, read_s, read)
    return out


CORNERS = 40
LOWEST_HZ = 0.02
FEWEST = 8


def smoothed_velocity(dive: Dive, time_s: Array) -> Array:
    """nu at the times (m,), (m, 6); 0 where nothing was measured."""
    out = np.zeros((len(time_s), 6))
    velocity = dive.velocity
    if velocity is not None and dive.velocity_smoothing_s > 0:
        velocity = Signal(velocity.time_s - dive.velocity_smoothing_s, velocity.value)
    read = [
        (signal, column, dof)
        for signal, column, dof in (
            *((velocity, i, i) for i in range(3)),
            *((dive.gyro, i, 3 + i) for i in range(3)),
            (dive.fog, 0, 5),
        )
        if signal is not None and len(signal) >= FEWEST
    ]
    speeds = side_by_side(lambda each: smoothed(each[0], each[1], time_s, dive.breaks_s), read)
    for (_, _, dof), speed in zip(read, speeds, strict=True):
        out[:, dof] = speed
    return out


def smoothed(signal: Signal, column: int, time_s: Array, breaks_s: Array) -> Array:
    """A column of a signal without its white noise, at rising times (m,), each run between breaks by itself; 0 if it
    has no finite sample."""
    if not len(breaks_s):
        return _smoothed(signal, column, time_s)
    runs = zip(
        np.split(time_s, np.searchsorted(time_s, breaks_s)),
        *(
            np.split(series, np.searchsorted(signal.time_s, breaks_s))
            for series in (signal.time_s, signal.value)
        ),
        strict=True,
    )
    parts = [
        _smoothed(Signal(read_s, value), column, at_s) if len(read_s) >= FEWEST else np.zeros(len(at_s))
        for at_s, read_s, value in runs
    ]
    return np.concatenate(parts)


def _smoothed(signal: Signal, column: int, time_s: Array) -> Array:
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
