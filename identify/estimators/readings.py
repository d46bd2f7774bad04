"""Collects the measurements of each degree of freedom in a dive, as channels of readings with one noise level each."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from identify.dive import Dive, Signal
from identify.estimators.innovations import INCREMENT, POSITION, VELOCITY

Array = NDArray[np.float64]

HEAVE, ROLL, PITCH, YAW = 2, 3, 4, 5
FEWEST = 5
NOISE_SPREAD = 1.0
LEAST_NOISE = 1e-6
MOST_HZ = 100.0
"""Faster readings are averaged down to about this rate: a vehicle does nothing within 10 ms that this would miss."""

TELLING = 3.0
"""A position or angle gives the speed only if it moves in a second by more than this many times its noise."""

FILTERED_M_S, FILTERED_SPREAD, FILTERED_COLOURED_M_S, FILTERED_HZ = 2e-3, 0.2, 0.015, 10.0
"""Start of the fit for an autopilot's own velocity: a little white noise, with the prior standard deviation of its
logarithm, and a slow error of its filter, which dominates. The velocity is thinned to FILTERED_HZ, because a reading
adds little to the reading 20 ms earlier."""


@dataclass(frozen=True)
class Channel:
    """Readings of one state by one sensor, (n,) each; the standard deviation of a reading is `scale` times the noise.

    A NaN reading only marks the start of a new increment. `noise` is the start value of the fitted noise,
    `noise_spread` the prior standard deviation of its logarithm. coloured: start value of the velocity's slow error,
    0 if it has none.
    """

    name: str
    time_s: Array
    value: Array
    scale: Array
    state_read: int
    noise: float
    noise_spread: float = NOISE_SPREAD
    coloured: float = 0.0


def channels(dive: Dive, dof: int, velocity: Signal | None, place: Signal | None) -> list[Channel]:
    """Return all measurements of an axis, the velocity reading first. If that is missing, return the position or
    angle alone, if it gives the velocity; otherwise nothing.

    `velocity` (n, 3) at the body's origin; `place` (n, 1) the integral of the axis's own velocity: depth, roll, pitch
    or heading.
    """
    if dof < 3:
        sensors = [
            _filtered(velocity, dof) if dive.velocity_is_filtered else _direct("dvl", velocity, dof, VELOCITY)
        ]
        if dof == HEAVE:
            # The controller acts on depth, so depth has to be among the readings.
            sensors.append(_direct("depth", place, 0, POSITION))
    else:
        sensors = [_rate(dive, dof)]
        if dof in (ROLL, PITCH) or steers_unheard(dive):
            sensors.append(_direct("attitude", place, 0, POSITION))
    if sensors[0] is None:
        alone = _direct("depth" if dof < 3 else "attitude", place, 0, POSITION)
        return [alone] if alone is not None and _tells_of_speed(alone) else []
    return [channel for channel in sensors if channel is not None]


def _tells_of_speed(place: Channel) -> bool:
    """Whether a position or angle moves in a second by clearly more than its noise."""
    after = np.searchsorted(place.time_s, place.time_s + 1.0)
    inside = after < len(after)
    if np.median(np.diff(place.time_s)) > 1.0 or not inside.any():
        return False
    moved = place.value[after[inside]] - place.value[inside]
    return bool(np.sqrt(np.mean(moved**2)) > TELLING * np.sqrt(2.0) * place.noise)


def steers_unheard(dive: Dive) -> bool:
    """Whether no recorded signal shows what the controller in yaw used. It may then have used the heading, which has
    to be among the readings."""
    return dive.nu_fb is None and (dive.fog is None or not len(dive.fog))


def noise_std(values: Array) -> float:
    """Standard deviation of the white noise on a smooth signal (n,), whose third difference is noise alone.

    At least the standard deviation that the signal's resolution causes.
    """
    steps = np.abs(np.diff(values))
    resolution = float(np.min(steps[steps > 0], initial=np.inf))
    white = float(np.median(np.abs(np.diff(values, 3))) / (0.6745 * np.sqrt(20.0)))
    return max(white, resolution / np.sqrt(12.0) if np.isfinite(resolution) else 0.0, LEAST_NOISE)


def increments(name: str, signal: Signal) -> Channel:
    """Convert mean rates, dated at the middle of their intervals, to angle increments, dated at the ends.

    Intervals meet halfway between two readings; an interval after a gap has the usual length.
    """
    middle, rate = signal.time_s, signal.value[:, 0]
    usual = float(np.median(np.diff(middle)))
    halfway = 0.5 * (middle[1:] + middle[:-1])
    gap = np.diff(middle) > 1.5 * usual
    start = np.concatenate([middle[:1] - usual / 2, np.where(gap, middle[1:] - usual / 2, halfway)])
    end = np.concatenate([np.where(gap, middle[:-1] + usual / 2, halfway), middle[-1:] + usual / 2])
    fresh = start[np.concatenate([[True], gap])]
    time_s = np.concatenate([end, fresh])
    order = np.argsort(time_s, kind="stable")
    value = np.concatenate([rate * (end - start), np.full(len(fresh), np.nan)])
    scale = np.concatenate([end - start, np.full(len(fresh), usual)])
    return Channel(name, time_s[order], value[order], scale[order], INCREMENT, noise_std(rate))


def _rate(dive: Dive, dof: int) -> Channel | None:
    """The more informative of fibre-optic gyro and IMU: it contains all that the other could add."""
    gyro = _direct("gyro", dive.gyro, dof - 3, VELOCITY)
    if dof != YAW or dive.fog is None or len(dive.fog) < FEWEST or np.ptp(dive.fog.value) == 0.0:
        return gyro
    fog = increments("fog", averaged(dive.fog)[0])
    return fog if gyro is None or _information(fog) > _information(gyro) else gyro


def _filtered(velocity: Signal | None, dof: int) -> Channel | None:
    """The velocity of an autopilot's own filter."""
    if velocity is None or len(velocity) < FEWEST:
        return None
    every = max(1, round(velocity.rate_hz / FILTERED_HZ))
    thin = Signal(velocity.time_s[::every], velocity.value[::every])
    read = _direct("filter", thin, dof, VELOCITY)
    if read is None:
        return None
    return replace(read, noise=FILTERED_M_S, noise_spread=FILTERED_SPREAD, coloured=FILTERED_COLOURED_M_S)


def _direct(name: str, signal: Signal | None, column: int, state_read: int) -> Channel | None:
    if signal is None:
        return None
    known = np.isfinite(signal.value[:, column])
    value = signal.value[known, column]
    if len(value) < FEWEST or np.ptp(value) == 0.0:
        return None
    mean, count = averaged(Signal(signal.time_s[known], value[:, None]))
    scale = np.sqrt(np.median(count) / count)
    return Channel(name, mean.time_s, mean.value[:, 0], scale, state_read, noise_std(mean.value[:, 0]))


def averaged(signal: Signal) -> tuple[Signal, Array]:
    """Means (m, k) over bins of equal duration, dated at the mean of the samples' times, and the number of samples in
    each (m,).

    The signal itself if it is not much faster than MOST_HZ.
    """
    each = round(signal.rate_hz / MOST_HZ)
    if each < 2:
        return signal, np.ones(len(signal))
    # The bins' edges lie between samples.
    since = (signal.time_s - signal.time_s[0]) * signal.rate_hz + 0.5
    _, bin_of = np.unique(np.floor(since / each), return_inverse=True)
    count = np.bincount(bin_of).astype(np.float64)
    time_s = np.bincount(bin_of, signal.time_s) / count
    columns = [np.bincount(bin_of, column) / count for column in signal.value.T]
    return Signal(time_s, np.column_stack(columns)), count


def _information(channel: Channel) -> float:
    rate_hz = 1.0 / max(float(np.median(np.diff(channel.time_s))), 1e-9)
    return rate_hz / channel.noise**2
