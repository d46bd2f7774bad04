"""Bursts: forces that come and go, as blows or as beats that last for seconds, in the innovations.

How far a push shows differs from stretch to stretch: quadratic drag stops it at speed and hardly at rest, and a
velocity that is read seldom shows little of it. Each stretch is judged by what noise alone makes of its score.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import product

import numpy as np
from numba import njit
from numpy.typing import NDArray

from bridge.arrays import Array
from identify.diagnose.causes.evidence import FOLDS
from identify.diagnose.filters.backwards import scores, scores_of_each
from identify.diagnose.filters.innovations import AxisInnovations
from identify.diagnose.filters.regression import piece_s

Runs = Sequence[tuple[float, float]]

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

DRAWS, TOGETHER = 128, 16
"""Draws of noise alone, which tell the spread of a stretch's score to 6 %, and how many of them go through a filter
together."""

LEAST_SHOWN = 0.2
"""Least spread of a stretch's score, relative to that of all. Where a push shows less, any small score would seem
large, and a stretch shows no burst."""

MOST_HIDDEN = 1.0
"""Most force that slow samples of the commands hide in a stretch that tells of a burst, as power by its mean over the
dive. Where commands jump at an unknown time they miss the thrust for all of a step at once, as a blow does."""

ROUNDS = 30


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

    def sums(self, of: "_AxisScores", rates: Sequence[float]) -> list["_StretchScores"]:
        """The score by stretch, turned at each of some rates in rad/s; at 0 as it is."""
        turned = self._turned(of.at_s)
        return [_StretchScores(turned(rate)(of.score[:, None])[:, :, 0], rate=rate) for rate in rates]

    def beside_noise(self, scores: "_StretchScores", of: "_AxisScores") -> "_StretchScores":
        """The score by stretch, over the spread that noise alone has in each."""
        turned = self._turned(of.at_s)
        total = turned(scores.rate)
        square = np.mean([total(some) ** 2 for some in of.noise], axis=(0, 2, 3))
        shown = square >= LEAST_SHOWN**2 * np.mean(square)
        if len(of.hidden):
            each = turned(0.0)(np.column_stack([of.hidden, np.ones(len(of.hidden))]))[:, 0]
            shown &= each[:, 0] <= MOST_HIDDEN * each[:, 1]
        spread = np.sqrt(np.maximum(square, 1e-300))
        value = np.where(shown, 1.0 / spread, 0.0)[:, None] * scores.total
        size = max(float(np.sqrt(np.sum(value**2) / max(value[shown].size, 1))), 1e-300)
        # The variance of a push's score is the precision of that push.
        return _StretchScores(value / size, np.where(shown, 1.0 / (spread * size), 0.0), scores.rate, shown)

    def _turned(self, at_s: Array) -> Callable[[float], Callable[[Array], Array]]:
        """Return a function of a rate of turn that gives the function to sum scores (n, k) at times (n,) by stretch,
        (m, dims, k)."""
        index, within = self.at(at_s)
        weight = _weight(within)

        def turned(rate: float) -> Callable[[Array], Array]:
            waves = [weight] if rate == 0 else [weight * np.cos(rate * at_s), weight * np.sin(rate * at_s)]
            rows = np.array(waves)
            return lambda scores: np.asarray(_by_stretch(scores, index, rows, self.count))

        return turned

    def burst(
        self, dof: int, scores: "_StretchScores", square: Array, dims: int, shown: NDArray[np.bool_]
    ) -> Iterator["Burst"]:
        """The burst with its gain on held-out stretches; none if the strongest axis is no more uneven than noise, or
        shows too seldom. square (m,): of the stretches, of which a push is `shown` in some."""
        if np.count_nonzero(shown) >= LEAST_STRETCHES and scores.uneven > 0:
            count = len(square)
            starts_s = (np.arange(count) + self.later) * self.long_s
            piece = (starts_s / piece_s(count * self.long_s)).astype(np.intp)
            gain = mixture_gain(square[shown], dims, piece[shown])
            yield Burst(
                dof, gain, self, scores, np.where(shown, square, 0.0), dims, _fitted(square[shown], dims)
            )


@dataclass(frozen=True)
class _AxisScores:
    """One axis' score (n,) by instant, at times at_s (n,), and those of draws of noise alone, (n, k) of
    k draws each.

    hidden (n,): power of the force that slow samples of the commands hide, by its mean; empty with commands that are
    known at all times.
    """

    at_s: Array
    score: Array
    noise: Sequence[Array]
    hidden: Array


@dataclass(frozen=True)
class _StretchScores:
    """One axis' score by stretch.

    total (m, dims): score, over its standard deviation once it is held against noise; unit (m,): newtons of one such
    standard deviation. rate: at which it is turned, rad/s. shown (m,): whether a push shows in a stretch.
    """

    total: Array
    unit: Array = field(default_factory=lambda: np.ones(1))
    rate: float = 0.0
    shown: NDArray[np.bool_] = field(default_factory=lambda: np.ones(1, np.bool_))

    @property
    def square(self) -> Array:
        return np.asarray(np.sum(self.total**2, axis=1))

    @property
    def uneven(self) -> float:
        """Excess of the fourth moment over a Gaussian's, relative to that."""
        square, dims = self.square[np.broadcast_to(self.shown, len(self.total))], self.total.shape[1]
        usual = (1.0 + 2.0 / dims) * float(np.mean(square)) ** 2
        return float(np.mean(square**2) / max(usual, 1e-300)) - 1.0


@dataclass(frozen=True)
class Burst:
    """A candidate burst in some stretches.

    dof: its strongest axis, with the score `scores`. gain: nats on held-out stretches. square (m,): sums of squares of
    `dims` values of each stretch, 0 where a push does not show. spreads: share of loud stretches, and the spread of
    quiet and of loud ones.
    """

    dof: int
    gain: float
    stretches: _Stretches
    scores: _StretchScores
    square: Array
    dims: int
    spreads: tuple[float, float, float]

    def force(self, time_s: Array) -> Array:
        """Likely push (n,), N or N m, of the loud stretches; of a beat, its amplitude."""
        of_one = self.scores.total.shape[1] == 1
        sizes = self.scores.total[:, 0] if of_one else np.sqrt(self.scores.square)
        loud = _is_loud(self.square, self.dims, *self.spreads)
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
    rng = np.random.default_rng(0)

    def by_instant(innovations: AxisInnovations, rows: Array) -> _AxisScores:
        draws = np.split(rng.standard_normal((DRAWS, len(rows))), DRAWS // TOGETHER)
        noise = [scores_of_each(innovations, some.T) for some in draws]
        axis, clipped = innovations.problem.axis, np.clip(rows, -MOST_SIGMA, MOST_SIGMA)
        hidden = (
            np.where(axis.step >= 0, axis.white_times[np.maximum(axis.step, 0)] ** 2, 0.0)
            if axis.sampled_s
            else np.zeros(0)
        )
        return _AxisScores(axis.time_s, scores(innovations, clipped), noise, hidden)

    of_axes = {dof: by_instant(*of_axis) for dof, of_axis in left.items()}
    runs_s = runs_s or ((float(time_s[0]), float(time_s[-1])),)
    for long_s, later in product((*BLOWS_S, *BEATS_S), LATER):
        stretches = _Stretches(long_s, later, runs_s)
        if stretches.count >= LEAST_STRETCHES:
            of_length = _blows if long_s in BLOWS_S else _beats
            yield from of_length(stretches, of_axes)


def _blows(stretches: _Stretches, of_axes: Mapping[int, _AxisScores]) -> Iterator[Burst]:
    by_dof = {dof: stretches.beside_noise(stretches.sums(of, (0.0,))[0], of) for dof, of in of_axes.items()}
    for dof, each in by_dof.items():
        yield from stretches.burst(dof, each, each.square, each.total.shape[1], each.shown)
    if len(by_dof) > 1:
        # A blow pushes several axes at once.
        dof = max(by_dof, key=lambda each: by_dof[each].uneven)
        square = np.sum([value.square for value in by_dof.values()], axis=0)
        shown = np.all([value.shown for value in by_dof.values()], axis=0)
        yield from stretches.burst(dof, by_dof[dof], square, len(by_dof), shown)


def _beats(stretches: _Stretches, of_axes: Mapping[int, _AxisScores]) -> Iterator[Burst]:
    for dof, of in of_axes.items():
        tried = stretches.sums(of, [2 * np.pi / period_s for period_s in _periods_s(stretches.long_s)])
        tried.sort(key=lambda each: -each.uneven)
        for turned in tried[:WEIGHED]:
            each = stretches.beside_noise(turned, of)
            yield from stretches.burst(dof, each, each.square, each.total.shape[1], each.shown)


@njit(cache=True, nogil=True)
def _by_stretch(scores: Array, index: NDArray[np.intp], waves: Array, count: int) -> Array:
    """Sums (count, dims, k) of scores (n, k) times waves (dims, n), by the stretch `index` (n,), of those from 0 to
    `count`."""
    out = np.zeros((count, waves.shape[0], scores.shape[1]))
    for i in range(len(index)):
        if 0 <= index[i] < count:
            for dim in range(waves.shape[0]):
                for c in range(scores.shape[1]):
                    out[index[i], dim, c] += waves[dim, i] * scores[i, c]
    return out


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
