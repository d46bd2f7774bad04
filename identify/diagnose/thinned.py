"""A dive with its fast readings averaged: a gap shows within tenths of a second, and every candidate is paid by the
reading."""

from dataclasses import replace

import numpy as np

from identify.dive import Dive, Signal

USUAL_HZ = 12.0
"""About so many readings a second are left."""


def thinned(dive: Dive) -> Dive:
    """The dive with gyros, attitude and depth averaged down to about USUAL_HZ."""
    return replace(
        dive,
        gyro=_averaged(dive.gyro),
        fog=_averaged(dive.fog),
        attitude=_averaged(dive.attitude),
        pressure=_averaged(dive.pressure),
        depth=_averaged(dive.depth),
    )


def _averaged(signal: Signal | None) -> Signal | None:
    """Means over k neighbours, dated at the mean of their times; those with a gap in between are left out."""
    if signal is None or (k := round(signal.rate_hz / USUAL_HZ)) < 2:
        return signal
    n = len(signal) // k
    time_s = signal.time_s[: n * k].reshape(n, k)
    value = signal.value[: n * k].reshape(n, k, -1).mean(axis=1)
    whole = np.ptp(time_s, axis=1) < 1.5 * (k - 1) / signal.rate_hz
    return Signal(time_s.mean(axis=1)[whole], value[whole])
