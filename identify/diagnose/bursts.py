"""What comes now and then, at times of its own: blows, or beats that last for seconds.

A disturbance that is one noise throughout gives every stretch of a dive the same spread. What comes and goes gives it
two: a mixture of a quiet and of a loud spread then foretells stretches held out better than one spread does.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from identify.diagnose.backwards import scores
from identify.diagnose.evidence import FOLDS
from identify.diagnose.own import Own
from identify.diagnose.whitened import PIECE_S

Array = NDArray[np.float64]

BLOWS_S = (0.7, 1.5, 3.0)
"""How long a blow lasts."""

BEATS_S = (5.0, 10.0)
"""How long a beat lasts that sets in and ends."""

SHORTEST_S, MOST_TURNS = 0.6, 0.5
"""Periods of beats: from what readings of a velocity just show, to so much of the stretch that they last."""

WEIGHED = 3
"""Of the beats of one length in one axis, so many with the most uneven stretches are weighed."""

MOST_SIGMA = 4.0
"""A reading further off is met as if it were so far: one wild reading is no blow, which moves many in a row."""

LEAST_STRETCHES = 20
ROUNDS = 30


@dataclass(frozen=True)
class _Told:
    """What one axis tells of every stretch: `total` (m, dims) over its spread, newtons of one such unit in `unit`."""

    total: Array
    unit: float

    @property
    def square(self) -> Array:
        return np.asarray(np.sum(self.total**2, axis=1))

    @property
    def uneven(self) -> float:
        """By how much the fourth moment is larger than a Gaussian's, over that."""
        square, dims = self.square, self.total.shape[1]
        usual = (1.0 + 2.0 / dims) * float(np.mean(square)) ** 2
        return float(np.mean(square**2) / max(usual, 1e-300)) - 1.0


@dataclass(frozen=True)
class Burst:
    """What seems to come now and then in stretches of `long_s`. dof: where it is strongest, of which `told` is.
    gain: nats on stretches held out. square (m,): sums of squares of `dims` values of each stretch."""

    dof: int
    gain: float
    told: _Told
    square: Array
    dims: int
    long_s: float

    def force(self, time_s: Array) -> Array:
        """The likely push (n,), N or N m, of the loud stretches; of a beat its size."""
        sizes = self.told.total[:, 0] if self.told.total.shape[1] == 1 else np.sqrt(self.told.square)
        pushes = _is_loud(self.square, self.dims, *_fitted(self.square, self.dims)) * sizes * self.told.unit
        place = ((time_s - time_s[0]) / self.long_s).astype(np.intp)
        return np.asarray(pushes[np.minimum(place, len(pushes) - 1)])


def bursts(left: Mapping[int, tuple[Own, Array]], time_s: Array) -> Iterator[Burst]:
    """The likeliest of every length, in what each axis (by degree of freedom) leaves of its rows."""
    clipped = {
        dof: (own.problem.axis.time_s, scores(own, np.clip(rows, -MOST_SIGMA, MOST_SIGMA)))
        for dof, (own, rows) in left.items()
    }
    whole_s = float(time_s[-1] - time_s[0])
    for long_s in BLOWS_S:
        if whole_s / long_s < LEAST_STRETCHES:
            return
        told = {dof: _stretches(*one, time_s, long_s, 0.0) for dof, one in clipped.items()}
        for dof, one in told.items():
            yield from _weighed(dof, one, one.square, one.total.shape[1], long_s)
        if len(told) > 1:
            # What hits a vehicle pushes it in several axes at once.
            dof = max(told, key=lambda one: told[one].uneven)
            yield from _weighed(
                dof, told[dof], np.sum([one.square for one in told.values()], axis=0), len(told), long_s
            )
    for long_s in BEATS_S:
        if whole_s / long_s < LEAST_STRETCHES:
            return
        for dof, axis in clipped.items():
            tried = [
                _stretches(*axis, time_s, long_s, 2 * np.pi / period_s) for period_s in _periods_s(long_s)
            ]
            tried.sort(key=lambda one: -one.uneven)
            for one in tried[:WEIGHED]:
                yield from _weighed(dof, one, one.square, one.total.shape[1], long_s)


def _periods_s(long_s: float) -> list[float]:
    """Half as far apart as stretches so long tell them."""
    rates = np.arange(1.0 / (MOST_TURNS * long_s), 1.0 / SHORTEST_S, 0.5 / long_s)
    return [float(1.0 / rate) for rate in rates]


def _stretches(at_s: Array, score: Array, time_s: Array, long_s: float, rate: float) -> _Told:
    count = int((time_s[-1] - time_s[0]) / long_s)
    place = np.clip(((at_s - time_s[0]) / long_s).astype(np.intp), 0, count)
    waves = [score] if rate == 0 else [score * np.cos(rate * at_s), score * np.sin(rate * at_s)]
    total = np.column_stack([np.bincount(place, wave, minlength=count + 1)[:count] for wave in waves])
    spread = max(float(np.sqrt(np.mean(total**2))), 1e-300)
    # The score of a push has as its variance the precision with which that push is known.
    return _Told(total / spread, 1.0 / spread)


def _weighed(dof: int, told: _Told, square: Array, dims: int, long_s: float) -> Iterator[Burst]:
    """Not where the strongest axis itself is no more uneven than one noise is."""
    if told.uneven > 0:
        piece = (np.arange(len(square)) * long_s / PIECE_S).astype(np.intp)
        yield Burst(dof, mixture_gain(square, dims, piece), told, square, dims, long_s)


def mixture_gain(square: Array, dims: int, piece: NDArray[np.intp]) -> float:
    """Nats that a quiet and a loud spread save over one spread, on pieces held out; square (m,): sums of squares of
    `dims` values of each stretch."""
    gain = 0.0
    for fold in range(FOLDS):
        out = piece % FOLDS == fold
        if out.any() and not out.all():
            share, quiet, loud = _fitted(square[~out], dims)
            one = _density(square[out], dims, float(np.mean(square[~out])) / dims)
            two = np.logaddexp(
                np.log1p(-share) + _density(square[out], dims, quiet),
                np.log(share) + _density(square[out], dims, loud),
            )
            gain += float(np.sum(two - one))
    return gain


def _density(square: Array, dims: int, spread: float) -> Array:
    """Its logarithm, but for what both models share."""
    return np.asarray(-0.5 * dims * np.log(spread) - 0.5 * square / spread)


def _is_loud(square: Array, dims: int, share: float, quiet: float, loud: float) -> Array:
    one = np.log1p(-share) + _density(square, dims, quiet)
    two = np.log(share) + _density(square, dims, loud)
    return np.asarray(np.exp(two - np.logaddexp(one, two)))


def _fitted(square: Array, dims: int) -> tuple[float, float, float]:
    """Share of loud stretches and both spreads, by expectation and maximisation (Dempster, Laird and Rubin 1977)."""
    mean = max(float(np.mean(square)) / dims, 1e-300)
    share, quiet, loud = 0.1, 0.7 * mean, 3.0 * mean
    for _ in range(ROUNDS):
        loudly = _is_loud(square, dims, share, quiet, loud)
        share = float(np.clip(np.mean(loudly), 1.0 / len(square), 0.5))
        loud = max(float(loudly @ square) / max(float(np.sum(loudly)) * dims, 1e-9), mean)
        quiet = max(float((1 - loudly) @ square) / max(float(np.sum(1 - loudly)) * dims, 1e-9), 1e-3 * mean)
    return share, quiet, loud
