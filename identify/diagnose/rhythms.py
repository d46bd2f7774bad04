"""Periodic and intermittent forces: spectral lines and bursts in the innovations, periods of seas.

A hull's own oscillation is periodic in time, vortex shedding in the distance travelled (a Strouhal number). All rates
are searched at once, in the spectrum of the score of a force at every instant. The score comes from the filter run
backwards: an innovation sums earlier pushes, so the adjoint sums each push's later innovations (Bryson and Ho 1975,
section 13.3).

A single disturbance gives every stretch of a dive the same spread. Bursts give two: a mixture of a quiet and a loud
spread then predicts held-out stretches better. Each stretch is weighed by a raised cosine (Blackman and Tukey 1958,
section B.5): the score has most of its power at high rates, where a smooth disturbance is weakest, and with sharp ends
that would leak into a stretch's sum. A burst at the end of one such stretch is in none, so that there are others that
begin in the middle of these (the overlapped segments of Welch 1967).

A sea's line off its period by a hundredth loses phase within a dive. Its periods come from the spectrum of the missing
force in world axes, in which a wave stays put while the vehicle turns.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import product
from typing import Literal

import numpy as np
from numba import njit
from numpy.typing import NDArray

from bridge.arrays import Array
from identify.diagnose.evidence import FOLDS
from identify.diagnose.innovations import AxisInnovations
from identify.diagnose.nominal import Nominal
from identify.diagnose.regression import piece_s
from identify.effects.course import Course
from identify.effects.effect import Effect
from identify.effects.environment import varying_current, waves
from identify.estimators.innovations import INCREMENT, NO_STEP, VELOCITY

Runs = Sequence[tuple[float, float]]

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
"""A line that starts and ends has sidebands: MOST_BESIDE at most, within BESIDE resolved rates."""

PRICE_NATS, SIDEBAND_NATS = 3.9, 3.2
"""Nats that a line must save beyond other forces.

Some 6000 rates of all axes are tried, held-out pieces included, at one false alarm in a thousand dives: ln(6e6), less
a force's ln(1.2e5). A sideband is one of 24.
"""

BLOWS_S = (0.7, 1.5, 3.0, 6.0, 12.0)
"""Lengths of a blow, s, up to the memory of a slow disturbance, which takes up most of a push that lasts as long and
leaves little of it to shorter stretches."""

BEATS_S = (5.0, 10.0)
"""Lengths of an intermittent beat, s."""

LATER = (0.0, 0.5)
"""Begin of the stretches, in stretches after that of their run."""

SHORTEST_S, MOST_TURNS = 0.6, 0.5
"""Periods of beats: from the shortest that velocity readings resolve, to this share of a beat's length."""

WEIGHED = 3
"""Number of beats weighed per length and axis, those with the most uneven stretches."""

MOST_SIGMA = 4.0
"""Clip of a row: a blow moves many rows, a single outlier is none."""

LEAST_STRETCHES = 20
ROUNDS = 30


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
    low, high = clock.band
    travelled = float(phase[-1] - phase[0])
    if travelled < 2 * high:
        return np.zeros(0), np.zeros(0)
    step = low / BINS
    count = int(travelled / step) + 1
    binned = np.bincount(((phase - phase[0]) / step).astype(np.intp), size * score, minlength=count)
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


@dataclass(frozen=True)
class _Stretches:
    """Stretches of `long_s` one after another in each run of a dive, none in two, the first of a run the share `later`
    of a stretch after its start. runs_s: first and last time of each run."""

    long_s: float
    later: float
    runs_s: Runs

    @property
    def count(self) -> int:
        """Number of whole stretches."""
        return sum(self._count(*run_s) for run_s in self.runs_s)

    def _count(self, start_s: float, end_s: float) -> int:
        return max(int((end_s - start_s) / self.long_s - self.later), 0)

    def at(self, at_s: Array) -> tuple[NDArray[np.intp], Array]:
        """Stretch (n,) of each time, and the share of it that is over. The remainder of a single run counts on; of
        several, as between two, the stretch is -1."""
        if len(self.runs_s) == 1:
            since = np.maximum((at_s - self.runs_s[0][0]) / self.long_s - self.later, 0.0)
            return since.astype(np.intp), since % 1.0
        out, within, first = np.full(len(at_s), -1, dtype=np.intp), np.zeros(len(at_s)), 0
        for start_s, end_s in self.runs_s:
            count = self._count(start_s, end_s)
            since = (at_s - start_s) / self.long_s - self.later
            inside = (since >= 0) & (since < count)
            out[inside], within[inside] = first + since[inside].astype(np.intp), since[inside] % 1.0
            first += count
        return out, within

    def sums(self, at_s: Array, score: Array, rate: float) -> "_StretchScores":
        """The score (n,) at times (n,) by stretch, turned at a rate in rad/s; at 0 as it is."""
        count = self.count
        index, within = self.at(at_s)
        index = np.where((index < 0) | (index > count), count, index)
        score = score * _weight(within)
        waves = [score] if rate == 0 else [score * np.cos(rate * at_s), score * np.sin(rate * at_s)]
        total = np.column_stack([np.bincount(index, wave, minlength=count + 1)[:count] for wave in waves])
        spread = max(float(np.sqrt(np.mean(total**2))), 1e-300)
        # The variance of a push's score is the precision of that push.
        return _StretchScores(total / spread, 1.0 / spread)

    def burst(self, dof: int, scores: "_StretchScores", square: Array, dims: int) -> Iterator["Burst"]:
        """The burst with its gain on held-out stretches; none if the strongest axis is no more uneven than noise."""
        if scores.uneven > 0:
            count = len(square)
            starts_s = (np.arange(count) + self.later) * self.long_s
            piece = (starts_s / piece_s(count * self.long_s)).astype(np.intp)
            yield Burst(dof, mixture_gain(square, dims, piece), self, scores, square, dims)


@dataclass(frozen=True)
class _StretchScores:
    """One axis' score by stretch.

    total (m, dims): score over its standard deviation; unit: newtons of one such standard deviation.
    """

    total: Array
    unit: float

    @property
    def square(self) -> Array:
        return np.asarray(np.sum(self.total**2, axis=1))

    @property
    def uneven(self) -> float:
        """Excess of the fourth moment over a Gaussian's, relative to that."""
        square, dims = self.square, self.total.shape[1]
        usual = (1.0 + 2.0 / dims) * float(np.mean(square)) ** 2
        return float(np.mean(square**2) / max(usual, 1e-300)) - 1.0


@dataclass(frozen=True)
class Burst:
    """A candidate burst in some stretches.

    dof: its strongest axis, with the score `scores`. gain: nats on held-out stretches. square (m,): sums of squares of
    `dims` values of each stretch.
    """

    dof: int
    gain: float
    stretches: _Stretches
    scores: _StretchScores
    square: Array
    dims: int

    def force(self, time_s: Array) -> Array:
        """Likely push (n,), N or N m, of the loud stretches; of a beat, its amplitude."""
        of_one = self.scores.total.shape[1] == 1
        sizes = self.scores.total[:, 0] if of_one else np.sqrt(self.scores.square)
        loud = _is_loud(self.square, self.dims, *_fitted(self.square, self.dims))
        pushes = loud * sizes * self.scores.unit
        index, within = self.stretches.at(time_s)
        return np.asarray(
            np.where(index >= 0, pushes[np.minimum(index, len(pushes) - 1)] * _weight(within), 0.0)
        )


def bursts(
    left: Mapping[int, tuple[AxisInnovations, Array]], time_s: Array, runs_s: Runs = ()
) -> Iterator[Burst]:
    """The likeliest burst of every length, in the residual rows of each axis (by degree of freedom). runs_s: first and
    last time of each run of a dive made of several."""
    clipped = {
        dof: (innovations.problem.axis.time_s, scores(innovations, np.clip(rows, -MOST_SIGMA, MOST_SIGMA)))
        for dof, (innovations, rows) in left.items()
    }
    runs_s = runs_s or ((float(time_s[0]), float(time_s[-1])),)
    for long_s, later in product((*BLOWS_S, *BEATS_S), LATER):
        stretches = _Stretches(long_s, later, runs_s)
        if stretches.count >= LEAST_STRETCHES:
            of_length = _blows if long_s in BLOWS_S else _beats
            yield from of_length(stretches, clipped)


def _blows(stretches: _Stretches, clipped: Mapping[int, tuple[Array, Array]]) -> Iterator[Burst]:
    by_dof = {dof: stretches.sums(*axis, 0.0) for dof, axis in clipped.items()}
    for dof, each in by_dof.items():
        yield from stretches.burst(dof, each, each.square, each.total.shape[1])
    if len(by_dof) > 1:
        # A blow pushes several axes at once.
        dof = max(by_dof, key=lambda each: by_dof[each].uneven)
        square = np.sum([value.square for value in by_dof.values()], axis=0)
        yield from stretches.burst(dof, by_dof[dof], square, len(by_dof))


def _beats(stretches: _Stretches, clipped: Mapping[int, tuple[Array, Array]]) -> Iterator[Burst]:
    for dof, axis in clipped.items():
        tried = [stretches.sums(*axis, 2 * np.pi / period_s) for period_s in _periods_s(stretches.long_s)]
        tried.sort(key=lambda each: -each.uneven)
        for each in tried[:WEIGHED]:
            yield from stretches.burst(dof, each, each.square, each.total.shape[1])


def _periods_s(long_s: float) -> list[float]:
    """Periods of beats, spaced at half the resolution of a stretch."""
    rates = np.arange(1.0 / (MOST_TURNS * long_s), 1.0 / SHORTEST_S, 0.5 / long_s)
    return [float(1.0 / rate) for rate in rates]


def _weight(within: Array) -> Array:
    """Weight (n,) of the instants of a stretch, by the share of it that is over."""
    return np.asarray(np.sin(np.pi * within) ** 2)


def mixture_gain(square: Array, dims: int, piece: NDArray[np.intp]) -> float:
    """Nats that two spreads save over one on held-out pieces.

    square (m,): sums of squares of `dims` values of each stretch.
    """
    gain = 0.0
    for fold in range(FOLDS):
        held = piece % FOLDS == fold
        if held.any() and not held.all():
            share, quiet, loud = _fitted(square[~held], dims)
            single = _density(square[held], dims, float(np.mean(square[~held])) / dims)
            mixture = np.logaddexp(
                np.log1p(-share) + _density(square[held], dims, quiet),
                np.log(share) + _density(square[held], dims, loud),
            )
            gain += float(np.sum(mixture - single))
    return gain


@njit(cache=True, nogil=True)
def _density(square: Array, dims: int, spread: float) -> Array:
    """Log density, without common terms."""
    return np.asarray(-0.5 * dims * np.log(spread) - 0.5 * square / spread)


@njit(cache=True, nogil=True)
def _is_loud(square: Array, dims: int, share: float, quiet: float, loud: float) -> Array:
    quiet_density = np.log1p(-share) + _density(square, dims, quiet)
    loud_density = np.log(share) + _density(square, dims, loud)
    return np.asarray(np.exp(loud_density - np.logaddexp(quiet_density, loud_density)))


@njit(cache=True, nogil=True)
def _fitted(square: Array, dims: int) -> tuple[float, float, float]:
    """Share of loud stretches and both spreads, by expectation maximisation (Dempster, Laird and Rubin 1977)."""
    mean = max(float(np.mean(square)) / dims, 1e-300)
    share, quiet, loud = 0.1, 0.7 * mean, 3.0 * mean
    for _ in range(ROUNDS):
        loudly = _is_loud(square, dims, share, quiet, loud)
        share = min(max(float(np.mean(loudly)), 1.0 / len(square)), 0.5)
        loud = max(float(np.sum(loudly * square)) / max(float(np.sum(loudly)) * dims, 1e-9), mean)
        quietly = 1.0 - loudly
        quiet = max(float(np.sum(quietly * square)) / max(float(np.sum(quietly)) * dims, 1e-9), 1e-3 * mean)
    return share, quiet, loud


def scores(innovations: AxisInnovations, left: Array) -> Array:
    """Derivative (n,) of the log likelihood of rows `left` (rows,) by the mean force of each step."""
    freed = left.copy()
    for autoregression in innovations.autoregressions:
        for lag, share in enumerate(autoregression.by_lag.tolist(), 1):
            freed[autoregression.rows[:-lag]] -= share * left[autoregression.rows[lag:]]
    axis = innovations.problem.axis
    return np.asarray(
        _backwards(
            innovations.table,
            innovations.problem.step,
            freed / innovations.std,
            innovations.read,
            axis.state_read,
            innovations.gain,
            axis.is_coloured,
        )
    )


@njit(cache=True, nogil=True, error_model="numpy")
def _backwards(
    table: Array,
    step: NDArray[np.int64],
    left: Array,
    read: NDArray[np.bool_],
    state_read: NDArray[np.int64],
    gain: Array,
    coloured: bool,
) -> Array:
    """The transpose of `estimators.innovations.responses`, for one column of rows."""
    out = np.zeros(step.shape[0])
    y0, y1, y2, y3 = 0.0, 0.0, 0.0, 0.0
    row = left.shape[0] - 1
    for i in range(step.shape[0] - 1, -1, -1):
        if state_read[i] == INCREMENT:
            y1 = 0.0
        if read[i]:
            e = left[row] - gain[i, 0] * y0 - gain[i, 1] * y1 - gain[i, 2] * y2 - gain[i, 3] * y3
            if state_read[i] != VELOCITY:
                y1 += e
            else:
                y0 += e
                if coloured:
                    y3 += e
            row -= 1
        if step[i] >= 0:
            t = table[step[i]]
            out[i] = (t[7] + t[9]) * y0 + (t[8] + t[10]) * y1
            y0, y1, y2, y3 = (
                t[0] * y0 + t[3] * y1,
                t[1] * y0 + t[4] * y1,
                t[2] * y0 + t[5] * y1 + t[6] * y2 + t[22] * y3,
                t[19] * y0 + t[20] * y1 + t[21] * y2 + t[17] * y3,
            )
        elif step[i] < NO_STEP:
            y0, y1, y2, y3 = 0.0, 0.0, 0.0, 0.0
    return out


WAVES_S, CURRENTS_S = (1.5, 12.0), (15.0, 200.0)
MOST_LINES = 4
NEAR, WIDE = 0.2, 3.0
"""A sea's lines lie within a share NEAR of the strongest line's rate; the background is a median within a factor
WIDE."""

CORNER_HZ = 0.1
"""A usual disturbance falls off as the square of the rate above this."""

LEAST_OVER = 4.0
"""Power of a further line over the background."""


def seas_of(now: Nominal) -> tuple[Effect, ...]:
    """The waves and varying currents that a dive may hold: each with the strongest line of its band, and with all
    significant lines of the band."""
    spectrum = _disturbance_spectrum(now)
    out: list[Effect] = []
    for sea, band_s in ((varying_current, CURRENTS_S), (waves, WAVES_S)):
        lines = _lines(spectrum, band_s)
        out += [sea(*lines[:count]) for count in sorted({1, len(lines)}) if lines]
    return tuple(out)


def period_interval(period_s: float, duration_s: float) -> tuple[float, float]:
    """Interval of a period read off a dive of that length.

    The spectrum's rates are whole numbers of cycles per dive, so a line is at most half a cycle off.
    """
    half = 0.5 / duration_s
    return 1.0 / (1.0 / period_s + half), 1.0 / max(1.0 / period_s - half, half)


def _disturbance_spectrum(now: Nominal) -> tuple[Array, Array]:
    """Rates (f,), Hz, and the power of the missing force, north, east and down together."""
    course = now.course
    missing = _missing(now)
    north, east, down = course.world
    world = np.column_stack([(missing * way).sum(axis=1) for way in (north, east, down)])
    every = max(round(0.2 / course.step_s), 1)
    whole = len(world) // every
    slow = world[: whole * every].reshape(whole, every, 3).mean(axis=1)
    slow = (slow - slow.mean(axis=0)) * np.hanning(whole)[:, None]
    power = (np.abs(np.fft.rfft(slow, axis=0)) ** 2).sum(axis=1)
    return np.asarray(np.fft.rfftfreq(whole, every * course.step_s), np.float64), np.asarray(
        power, np.float64
    )


def _missing(now: Nominal) -> Array:
    """The missing force (n, 3) of the smoothed motion, beyond thrust, drag, Coriolis forces and the causes so far."""
    course, nu = now.course, now.motion.nu
    moving = course.mass * np.gradient(nu, course.step_s, axis=0) + course.damping * nu
    given = course.wrench_of(course.thrust_n) - course.coriolis_of(course.mass, nu)
    for act in (*now.acts, *(cause.act(course) for cause in now.accepted)):
        if act.wrench is not None:
            given = given + act.wrench
    fitted = [problem.axis.dof for problem in now.joint.problems]
    out = np.where(np.isin(np.arange(6), fitted), moving - given, 0.0)[:, :3]
    return np.asarray(np.where(course.recorded[:, None], out, 0.0))


def _lines(spectrum: tuple[Array, Array], band_s: tuple[float, float]) -> Sequence[float]:
    """Periods, s, of the lines that stand out most over the background, strongest first."""
    rate, power = spectrum
    power = power * (1.0 + (rate / CORNER_HZ) ** 2)
    inside = np.flatnonzero((rate > 1.0 / band_s[1]) & (rate < 1.0 / band_s[0]))
    if len(inside) < 2 * MOST_LINES:
        return ()
    around = np.array([np.median(power[(rate > rate[i] / WIDE) & (rate < WIDE * rate[i])]) for i in inside])
    over = power[inside] / np.maximum(around, 1e-300)
    order = np.argsort(-over)
    first = inside[order[0]]
    lines = [first]
    for k in order[1:].tolist():
        i = inside[k]
        apart = min(abs(i - line) for line in lines) > 1
        if apart and over[k] > LEAST_OVER and abs(rate[i] - rate[first]) < NEAR * rate[first]:
            lines.append(i)
        if len(lines) == MOST_LINES:
            break
    return [float(1.0 / _peak(rate, power, i)) for i in lines]


def _peak(rate: Array, power: Array, i: int) -> float:
    """A line's rate between grid points, by a parabola through three log powers."""
    if not 0 < i < len(rate) - 1:
        return float(rate[i])
    low, middle, high = np.log(np.maximum(power[i - 1 : i + 2], 1e-300))
    bend = low - 2 * middle + high
    shift = 0.5 * (low - high) / bend if bend < 0 else 0.0
    return float(rate[i] + np.clip(shift, -0.5, 0.5) * (rate[1] - rate[0]))
