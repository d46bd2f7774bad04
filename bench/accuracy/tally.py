"""A method's trials evaluated against the bounds of their missions: errors, refusals, intervals."""

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from bench.accuracy.pooled import share95
from bench.accuracy.trials import Bound, Stated, Trial

TELLING = 0.30
"""Coefficients that no method could know to this relative error are counted apart."""

NORMAL_MEDIAN = 0.6744897501960817
CONVERGED = "converged"


@dataclass(frozen=True)
class Case:
    """A coefficient of a mission as a method states it: error over the bound, and stated uncertainty.

    `error` is that of the logarithm, in units of the bound's relative standard error, which is `least`; `relative` is
    that of the value itself.
    """

    seed: int
    name: str
    kind: str
    error: float
    relative: float
    least: float
    inside: bool
    z: float
    warned: bool


@dataclass(frozen=True)
class Tally:
    """A method's cases with a bound below TELLING, and its numbers of refused and stated coefficients.

    refused: below TELLING; refused_rightly, stated_rashly: at or above it.
    """

    method: str
    cases: tuple[Case, ...]
    refused: int
    refused_rightly: int
    stated_rashly: int
    seconds: float
    missions: int

    @property
    def refused_share(self) -> float:
        """Refused share of the coefficients whose bound is below TELLING."""
        asked = self.refused + len(self.cases)
        return self.refused / asked if asked else math.nan


def tally(method: str, bounds: Iterable[Bound], trials: Iterable[Trial]) -> Tally:
    by_seed = {trial.seed: trial for trial in trials if trial.method == method}
    cases: list[Case] = []
    refused = rightly = rashly = 0
    for bound in bounds:
        if (trial := by_seed.get(bound.seed)) is None:
            continue
        for name in bound.truth:
            stated, least = trial.stated.get(name), bound.least[name]
            if stated is None:
                refused += least < TELLING
                rightly += least >= TELLING
            elif least >= TELLING:
                rashly += 1
            else:
                warned = stated.doubted or trial.outcome != CONVERGED
                cases.append(_case(bound, name, stated, warned))
    seconds = float(np.median([trial.seconds for trial in by_seed.values()])) if by_seed else math.nan
    return Tally(method, tuple(cases), refused, rightly, rashly, seconds, len(by_seed))


def _case(bound: Bound, name: str, stated: Stated, warned: bool) -> Case:
    truth, least = bound.truth[name], bound.least[name]
    ratio = stated.value / truth
    # A mass below zero has no logarithm: its relative error counts instead.
    error = math.log(ratio) if ratio > 0 else ratio - 1.0
    inside = stated.low95 <= truth <= stated.high95
    return Case(
        bound.seed, name, bound.kind, error / least, ratio - 1.0, least, inside, error / stated.std, warned
    )


def root_mean_square(cases: Iterable[Case]) -> float:
    """Rms of the errors over the bound: 1 for a method that does all that can be done."""
    errors = np.array([case.error for case in cases])
    return float(np.sqrt(np.mean(errors**2))) if len(errors) else math.nan


def median_ratio(cases: Iterable[Case]) -> float:
    """Median error over the median of normal errors at the bound: also 1 at best, and insensitive to a few wild
    errors."""
    errors = np.array([case.error for case in cases])
    return float(np.median(np.abs(errors)) / NORMAL_MEDIAN) if len(errors) else math.nan


def inside95(cases: Sequence[Case]) -> tuple[float, float, float]:
    """Share of intervals that hold the truth, and its 95 % bounds; a mission's coefficients count as correlated."""
    return share95([case.inside for case in cases], [case.seed for case in cases])
