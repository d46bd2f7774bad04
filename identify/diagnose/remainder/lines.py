"""Spectral lines: forces that oscillate in time or along the way travelled, in the innovations."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Literal

import numpy as np

from bridge.arrays import Array
from identify.diagnose.filters.backwards import scores
from identify.diagnose.filters.innovations import AxisInnovations
from identify.effects.course import Course

PERIODS_S, WAVES_M = (0.6, 60.0), (0.3, 8.0)
"""Bands of wavelengths, in seconds or metres: velocity readings do not resolve shorter ones, and a disturbance mimics
longer ones."""

BINS = 4
"""Bins per shortest wavelength."""

FINER = 4
"""Number of rates tried per rate that a dive resolves."""

AROUND = 40
"""Neighbouring rates that give the chance level of power."""

LIKELY_NATS = 10.0
"""Least nats in sample of a likely line; on most dives without a line, the best of all rates saves less."""

MOST = 3

SIDEBAND, MOST_SIDEBANDS = 12, 6
"""A line that starts and ends has sidebands: MOST_SIDEBANDS at most, within SIDEBAND resolved rates."""

PRICE_NATS, SIDEBAND_NATS = 3.9, 3.2
"""Nats that a line must save beyond other forces.

Some 6000 rates of all axes are tried, held-out pieces included, at one false alarm in a thousand dives: ln(6e6), less
a force's ln(1.2e5). A sideband is one of 24.
"""


@dataclass(frozen=True)
class Clock:
    """Phase of an oscillation (n,), nondecreasing, in seconds or metres, with its band of wavelengths.

    size (n,): the oscillation's amplitude.
    """

    by: Literal["time", "way"]
    phase: Array
    band: tuple[float, float]
    size: Array


@dataclass(frozen=True)
class Cluster:
    """Oscillations in radians per unit of their clock, strongest first; nats: of the first, in sample."""

    clock: Clock
    rates: tuple[float, ...]
    nats: float

    @property
    def price_nats(self) -> float:
        return PRICE_NATS + SIDEBAND_NATS * (len(self.rates) - 1)

    def forces(self) -> Array:
        """Forces (2 k, n): in phase with the clock, and a quarter of a period off."""
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


def clusters(innovations: AxisInnovations, left: Array, course: Course) -> list[Cluster]:
    """The strongest lines of the rows `left` (rows,) of one axis, and the strongest in time: each alone, and with its
    sidebands.

    At a steady speed a line in time is one in the way travelled, too, but broad: several of its rates, each in two
    forces, may be stronger than the line itself.
    """
    score, time_s = scores(innovations, left), innovations.problem.axis.time_s
    # A step's force is the mean over it.
    middle = time_s - 0.5 * innovations.problem.axis.step_s
    lines = [peak for clock in clocks(course) for peak in _peaks(clock, score, middle, course.time_s)]
    lines.sort(key=lambda each: -each[0].nats)
    in_time = [line for line in lines if line[0].clock.by == "time"][:MOST]
    others = [line for line in lines[:MOST] if line[0].clock.by != "time"]
    return [cluster for line in (*in_time, *others) for cluster in line]


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
        near = [
            j for j in peaks.tolist() if 0 < abs(i - j) <= FINER * SIDEBAND and nats[j] > SIDEBAND_NATS + 2.0
        ]
        groups = [(i,)] if not near else [(i,), (i, *near[:MOST_SIDEBANDS])]
        yield tuple(Cluster(clock, tuple(rate[list(k)].tolist()), float(nats[i])) for k in groups)


def _spectrum(clock: Clock, score: Array, at_s: Array, time_s: Array) -> tuple[Array, Array]:
    """Rates and the nats of each.

    By chance, the variance of a force's score is its information. Empty for a clock that hardly moves.
    """
    phase, size = np.interp(at_s, time_s, clock.phase), np.interp(at_s, time_s, clock.size)
    phase -= phase.min()
    low, high = clock.band
    travelled = float(phase.max())
    if travelled < 2 * high:
        return np.zeros(0), np.zeros(0)
    step = low / BINS
    count = int(travelled / step) + 1
    binned = np.bincount((phase / step).astype(np.intp), size * score, minlength=count)
    power = np.abs(np.fft.rfft(binned, FINER * count)) ** 2
    rate = 2 * np.pi * np.arange(len(power)) / (FINER * count * step)
    inside = (rate > 2 * np.pi / high) & (rate < 2 * np.pi / low)
    rate, power = rate[inside], power[inside]
    reach = FINER * AROUND
    # The median of chance power is ln 2 of its mean.
    middles = np.arange(0, len(power), max(reach // 4, 1))
    chance_power = [np.median(power[max(0, i - reach) : i + reach + 1]) for i in middles.tolist()]
    around = np.interp(np.arange(len(power)), middles, chance_power) if len(middles) else np.ones(0)
    nats: Array = np.log(2) * power / np.maximum(around, 1e-300)
    return np.asarray(rate, np.float64), nats
