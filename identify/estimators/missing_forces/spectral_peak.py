"""A narrow peak in the spectrum of an axis's innovations, as waves or a swinging hull make it.

The innovations of a right model are white, so the power of each rate is exponential about its neighbours' mean. The
power over the mean of k neighbours exceeds g with a chance of (1 + g / k)^-k, the F distribution with 2 and 2k degrees
of freedom; for all rates tried, by Bonferroni's bound. Fisher's test (1929) compares with all rates instead, but a
disturbance that is not of first order makes the slow rates louder.
"""

from dataclasses import dataclass

import numpy as np

from bridge.arrays import Array

SHORTEST_S, FEWEST_SWINGS = 1.0, 12
"""Waves of shorter periods move no vehicle; of few swings in a dive, neighbours are other forces."""

AROUND, APART = 40, 4
"""Neighbours on either side, and how far off the nearest is: a peak between two rates, or of a swing that grows, has
sides."""

FEWEST = 200
"""Fewer readings tell no spectrum."""


@dataclass(frozen=True)
class Peak:
    """A peak at `period_s`; `score` is z if its chance is at most exp(-z^2 / 2)."""

    score: float
    period_s: float


def peak_of(time_s: Array, white: Array) -> Peak:
    """The clearest spectral peak of normalised innovations (m,) at times (m,), evenly spaced except for pauses."""
    if len(white) < FEWEST:
        return Peak(0.0, SHORTEST_S)
    white = _with_pauses(time_s, white - np.mean(white))
    count = len(white)
    span_s = (time_s[-1] - time_s[0]) * count / (count - 1)
    # Padded to twice its length or more: half a rate apart, no peak falls between two rates.
    length = 1 << (2 * count - 1).bit_length()
    power = np.abs(np.fft.rfft(white, length)) ** 2
    rates_hz = np.arange(len(power)) * count / (length * span_s)
    finer = length // count
    apart, around = APART * finer, (APART + AROUND) * finer
    total = np.concatenate([[0.0], np.cumsum(power)])
    tried = np.flatnonzero((rates_hz > FEWEST_SWINGS / span_s) & (rates_hz < 1.0 / SHORTEST_S))
    tried = tried[(tried >= around) & (tried + around < len(power))]
    if not len(tried):
        return Peak(0.0, SHORTEST_S)
    sides = (total[tried + around + 1] - total[tried + apart + 1]) + (
        total[tried - apart] - total[tried - around]
    )
    over = power[tried] * 2 * (around - apart) / np.maximum(sides, 1e-300)
    highest = int(np.argmax(over))
    chance = np.log(len(tried)) - 2 * AROUND * np.log1p(over[highest] / (2 * AROUND))
    return Peak(float(np.sqrt(max(-2.0 * chance, 0.0))), float(1.0 / rates_hz[tried[highest]]))


def _with_pauses(time_s: Array, white: Array) -> Array:
    """Innovations (n,) with 0 where a pause lacks readings, at times (m,) about evenly apart but for pauses."""
    steps_s = np.diff(time_s, prepend=time_s[0])
    usual_s = float(np.median(steps_s[steps_s > 0]))
    place = np.cumsum(np.maximum(np.rint(steps_s / usual_s), 1.0)).astype(np.intp) - 1
    out = np.zeros(int(place[-1]) + 1)
    out[place] = white
    return out
