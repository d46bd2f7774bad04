"""Leaves out a gyro whose rates were smoothed before they were logged, while the attitude was not.

A mean over a second about each moment shows a turn before the thrust that makes it. A fit to it takes all turning for a
disturbance, and inertia and damping come out at any value. Smoothing is told from noise by spectra, of the attitude's
turning x and of the gyro's y. The gain S_yy / |S_xy| is 1 whatever the attitude's noise, and above it with the gyro's;
of n pieces, its relative standard error is sqrt((1 - c) / (2 n c)) with c the coherence |S_xy|^2 / (S_xx S_yy) (Bendat
and Piersol 2010, table 9.6). Smoothing alone brings it down.
"""

from dataclasses import replace
from typing import Final

import numpy as np

from bridge.arrays import Array
from identify.checks.sensors.sensor_pairs import readings, turns_between
from identify.dive import Dive

SEGMENT_S, FEWEST_SEGMENTS = 5.0, 10
"""Length of the pieces whose spectra are averaged, and the least number of them."""
COHERENT: Final = 0.3
"""Coherence below which the attitude's noise hides its turning, and a smoothed gyro may tell more."""
SIGMAS: Final = 3.0
"""Standard errors by which a gain has to be below LOST."""
LOST, KEPT, FEWEST_LOST = 0.5, 0.7, 2
"""Gain of a smoothed gyro, below, at several fast rates, and above, at slow ones: a gyro of a wrong scale shows too
little of any."""
FASTEST: Final = 0.25
"""Share of the slower sensor's rate up to which its readings tell the turning between them."""
TINY: Final = 1e-300
"""Instead of no power at all, of an axis that nothing reads."""


def without_smoothed_gyro(dive: Dive) -> Dive:
    """The dive without a gyro that was smoothed, if the attitude tells the rates better; with a note."""
    from_hz = _smoothed_from_hz(dive)
    if from_hz is None:
        return dive
    note = (
        f"The gyro's rates were smoothed before they were logged: of turns at {from_hz:.1f} Hz and faster they show "
        "less than half of what the attitude does, and no noise; they are left out, and the attitude tells how the "
        "vehicle turns. Log the rates as the gyro gives them."
    )
    return replace(dive, gyro=None, notes=(*dive.notes, note))


def _smoothed_from_hz(dive: Dive) -> float | None:
    """The rate from which on the gyro lacks turning that it shares with the attitude; None if it lacks none."""
    attitude, gyro = readings(dive.attitude), readings(dive.gyro)
    slowest_hz = 0.0 if attitude is None or gyro is None else min(attitude.rate_hz, gyro.rate_hz)
    length = round(SEGMENT_S * slowest_hz)
    if attitude is None or gyro is None or length < 1 / FASTEST:
        return None
    step_s = 1.0 / slowest_hz
    start_s = max(attitude.time_s[0], gyro.time_s[0])
    count = int((min(attitude.time_s[-1], gyro.time_s[-1]) - start_s) / (length * step_s))
    if count < FEWEST_SEGMENTS:
        return None
    edges_s = start_s + step_s * np.arange(count * length + 1)
    # A pause of the gyro takes as much of S_yy as of S_xy, and one of the attitude more of S_xy.
    seen, said = (turns.reshape(count, length, 3) for turns in turns_between(attitude, gyro, edges_s))
    rates_hz = np.fft.rfftfreq(length, step_s)
    near = slice(1, 1 + int(np.searchsorted(rates_hz[1:], FASTEST / step_s, side="right")))
    lost = [_first_lost(seen[:, :, axis], said[:, :, axis], near) for axis in range(3)]
    return min((float(rates_hz[near][at]) for at in lost if at is not None), default=None)


def _first_lost(seen: Array, said: Array, near: slice) -> int | None:
    """The first of the rates `near` at which a gyro has lost turning, by pieces of both (m, n); None if at none.

    It has to be lost without any one piece, too: an estimator that aligns makes a step of the attitude in one piece.
    """
    window = np.hanning(seen.shape[1])
    x, y = (np.fft.rfft((each - each.mean(1, keepdims=True)) * window)[:, near] for each in (seen, said))
    powers = np.array([np.conj(x) * y, np.abs(x) ** 2, np.abs(y) ** 2])
    total, count = powers.sum(axis=1), len(x)
    without_one = ((total - powers[:, k]) / (count - 1) for k in range(count))
    if any(_lost(each, count) is None for each in without_one):
        return None
    return _lost(total / count, count)


def _lost(powers: Array, count: int) -> int | None:
    """The same by the mean powers (3, k) of `count` pieces: of both, of the attitude and of the gyro."""
    of_both, of_seen, of_said = powers[0], powers[1].real, powers[2].real
    shared = np.abs(of_both) ** 2
    coherence = np.minimum(shared / np.maximum(of_seen * of_said, TINY), 1.0)
    known = np.flatnonzero(coherence > COHERENT)
    gain = of_said[known] / np.sqrt(shared[known])
    error = np.sqrt((1.0 - coherence[known]) / (2.0 * count * coherence[known]))
    lost = known[gain * (1.0 + SIGMAS * error) < LOST]
    return int(lost[0]) if len(lost) >= FEWEST_LOST and gain[0] > KEPT else None
