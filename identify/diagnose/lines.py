"""Forces that come and go evenly, by time or by the way made: an oscillation whose rate nobody knows beforehand.

What beats in a hull beats by the clock; what the flow sheds from it goes by the way (Strouhal's number: a force of so
many beats a metre). All rates are looked through at once, in the spectrum of what the innovations say of the force.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from bridge.effects.course import Course
from identify.diagnose.backwards import scores
from identify.diagnose.own import Own

Array = NDArray[np.float64]

PERIODS_S, WAVES_M = (0.6, 60.0), (0.3, 8.0)
"""Quicker than the first of each, readings of a velocity tell little; slower than the last, a disturbance is alike."""

BINS = 4
"""Of the shortest wavelength."""

FINER = 4
"""Rates looked at, over those that a dive tells apart."""

AROUND = 40
"""Of these rates, so many stand around one, from which the power is taken that chance gives it."""

LIKELY_NATS = 10.0
"""In sample; the best of all rates saves less by chance in most dives."""

MOST = 3

BESIDE, MOST_BESIDE = 12, 6
"""A beat that sets in and ends has lines beside its own: within so many that a dive tells apart, so many are taken."""

PRICE_NATS, BESIDE_NATS = 3.9, 3.2
"""What a line must save more than another force: some 6000 rates of all axes are looked through, in the pieces held out
as well, and one dive in a thousand may deceive: ln(6e6), less ln(1.2e5) of a force. One beside it is among 24."""


@dataclass(frozen=True)
class Clock:
    """What an oscillation goes by: `phase` (n,) that never falls, seconds or metres, in a band of wavelengths; how
    strongly it pushes, `size` (n,)."""

    by: Literal["time", "way"]
    phase: Array
    band: tuple[float, float]
    size: Array


@dataclass(frozen=True)
class Cluster:
    """Oscillations together, so many radians each a unit of their clock, the strongest first; nats: what that one
    seems to save in sample."""

    clock: Clock
    rates: tuple[float, ...]
    nats: float

    @property
    def price_nats(self) -> float:
        return PRICE_NATS + BESIDE_NATS * (len(self.rates) - 1)

    def forces(self) -> Array:
        """(2 k, n): in step with the clock, and a quarter of a period off."""
        angles = [rate * self.clock.phase for rate in self.rates]
        return np.stack(
            [self.clock.size * wave for angle in angles for wave in (np.sin(angle), np.cos(angle))]
        )


def clocks(course: Course) -> Iterator[Clock]:
    u, v, w = course.nu[:, :3].T
    yield Clock("time", course.since_s, PERIODS_S, np.ones(len(u)))
    for speed in (u, v, w):
        way = np.concatenate([[0.0], np.cumsum(np.abs(speed[:-1]))]) * course.step_s
        for size in (speed**2, speed * np.abs(speed)):
            yield Clock("way", way, WAVES_M, size)


def clusters(own: Own, left: Array, course: Course) -> list[Cluster]:
    """What stands out most of the rows `left` (rows,) of one axis: each line alone, and with those beside it."""
    score, time_s = scores(own, left), own.problem.axis.time_s
    # A step's force is the mean over it.
    middle = time_s - 0.5 * np.diff(time_s, prepend=time_s[:1])
    found = [one for clock in clocks(course) for one in _peaks(clock, score, middle, course.time_s)]
    found.sort(key=lambda one: -one[0].nats)
    return [cluster for one in found[:MOST] for cluster in one]


def _peaks(clock: Clock, score: Array, at_s: Array, time_s: Array) -> Iterator[tuple[Cluster, ...]]:
    rate, nats = _spectrum(clock, score, at_s, time_s)
    if len(rate) < 2 * AROUND:
        return
    inner = nats[1:-1]
    peaks = 1 + np.flatnonzero((inner >= nats[:-2]) & (inner >= nats[2:]))
    peaks = peaks[np.argsort(-nats[peaks])]
    for i in peaks[:MOST].tolist():
        if nats[i] < LIKELY_NATS:
            return
        near = [j for j in peaks.tolist() if 0 < abs(i - j) <= FINER * BESIDE and nats[j] > BESIDE_NATS + 2.0]
        some = [(i,)] if not near else [(i,), (i, *near[:MOST_BESIDE])]
        yield tuple(Cluster(clock, tuple(rate[list(k)].tolist()), float(nats[i])) for k in some)


def _spectrum(clock: Clock, score: Array, at_s: Array, time_s: Array) -> tuple[Array, Array]:
    """Rates, and the nats that each would save, for chance gives the score of a force the variance of what that force
    shows; empty where the clock hardly moves."""
    phase, size = np.interp(at_s, time_s, clock.phase), np.interp(at_s, time_s, clock.size)
    low, high = clock.band
    whole = float(phase[-1] - phase[0])
    if whole < 2 * high:
        return np.zeros(0), np.zeros(0)
    step = low / BINS
    count = int(whole / step) + 1
    binned = np.bincount(((phase - phase[0]) / step).astype(np.intp), size * score, minlength=count)
    power = np.abs(np.fft.rfft(binned, FINER * count)) ** 2
    rate = 2 * np.pi * np.arange(len(power)) / (FINER * count * step)
    inside = (rate > 2 * np.pi / high) & (rate < 2 * np.pi / low)
    rate, power = rate[inside], power[inside]
    reach = FINER * AROUND
    # Half of what chance gives lies below ln 2 of its mean.
    middles = np.arange(0, len(power), max(reach // 4, 1))
    usual = [np.median(power[max(0, i - reach) : i + reach + 1]) for i in middles.tolist()]
    around = np.interp(np.arange(len(power)), middles, usual) if len(middles) else np.ones(0)
    nats: Array = np.log(2) * power / np.maximum(around, 1e-300)
    return np.asarray(rate, np.float64), nats
