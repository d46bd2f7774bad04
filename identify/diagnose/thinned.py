"""A dive with fewer of its fast readings: a gap shows within tenths of a second, and every candidate is paid by the
reading."""

from dataclasses import replace

import numpy as np

from identify.dive import Dive, Signal

USUAL_HZ = 25.0
"""About so many readings a second are left."""


def thinned(dive: Dive) -> Dive:
    """The dive with gyros and depth thinned to about USUAL_HZ.

    Of readings of an instant every k-th is kept: the mean of some is no reading of any instant, and roll and pitch are
    quick enough to show the difference, and more so the slower they are read. A fibre-optic gyro's are means over
    intervals, and so are means of these.
    """
    return replace(
        dive,
        gyro=_kept(dive.gyro),
        fog=_averaged(dive.fog),
        pressure=_kept(dive.pressure),
        depth=_kept(dive.depth),
    )


def _each(signal: Signal) -> int:
    return max(round(signal.rate_hz / USUAL_HZ), 1)


def _kept(signal: Signal | None) -> Signal | None:
    """Every k-th reading."""
    if signal is None or not len(signal):
        return signal
    k = _each(signal)
    return Signal(signal.time_s[::k], signal.value[::k])


def _averaged(signal: Signal | None) -> Signal | None:
    """Means over k neighbours, dated at the mean of their times; those with a gap in between are left out."""
    if signal is None or not len(signal) or (k := _each(signal)) < 2:
        return signal
    n = len(signal) // k
    time_s = signal.time_s[: n * k].reshape(n, k)
    value = signal.value[: n * k].reshape(n, k, -1).mean(axis=1)
    whole = np.ptp(time_s, axis=1) < 1.5 * (k - 1) / signal.rate_hz
    return Signal(time_s.mean(axis=1)[whole], value[whole])
