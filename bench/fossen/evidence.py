"""Decide which candidate two runs support, and how probable each cause is, by pieces held out."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

from bench.fossen.candidates import ALONE, ANYTHING, alone, beside
from bench.fossen.fit import Candidate, Pair, Weighed, weigh
from bench.fossen.runs import STATES, Columns
from identify.diagnose.shrunk import LIKELY
from identify.diagnose.verdict import probability


@dataclass(frozen=True)
class Judged:
    """The result for two runs.

    pair: the run that is assumed to be plain, and the other. run: name of the other run, None if it may be either.
    found: the candidate that the runs support; weighed: all candidates tried on these runs.
    """

    pair: Pair
    run: str | None
    found: Weighed
    weighed: tuple[Weighed, ...]

    @property
    def verdict(self) -> str:
        """no_gap, explained, or unknown if the cause has no name."""
        if self.found.candidate is ALONE:
            return "no_gap"
        return "unknown" if ANYTHING in self.found.candidate.causes else "explained"

    @property
    def probabilities(self) -> dict[str, float]:
        """Probability of each named cause: by how far the best candidate without it falls behind."""
        out = {}
        for cause in self.found.candidate.causes:
            without = [weighed for weighed in self.weighed if cause not in weighed.candidate.causes]
            out[cause] = min(probability(nats(self.found, weighed)) for weighed in without)
        return {cause: likelihood for cause, likelihood in out.items() if cause != ANYTHING}


def nats(one: Weighed, other: Weighed) -> float:
    """Log likelihood, in nats, by which `one` predicts the pieces held out better than `other`.

    A piece counts once for each state, because residuals are correlated, but no longer than a piece lasts.
    """
    if not one.mean_square > 0:
        return math.inf if other.mean_square > 0 else 0.0
    ratio = other.mean_square / one.mean_square
    return 0.5 * len(STATES) * one.pieces * math.log(max(ratio, 1e-300))


def judged(vehicle: str, runs: dict[str, Columns]) -> Judged:
    """Find the effect that one of the runs `a` and `b` holds and the other does not.

    Tries one cause at a time, in either run, then a second cause in addition to the best. Each step is accepted if
    its gain on the pieces held out is more likely real than not.
    """
    pairs = {name: Pair(vehicle, runs[other], runs[name]) for name, other in ("ab", "ba")}
    tried = {name: _weighed(pair, alone(vehicle)) for name, pair in pairs.items()}
    # A change of sizes explains either run equally well, so it does not say which run is the odd one.
    run = max(tried, key=lambda name: nats(_best(_named(tried[name])), tried[name][0]))
    weighed, found = tried[run], _best(tried[run])
    if probability(nats(found, weighed[0])) < LIKELY:
        return Judged(pairs[run], None, weighed[0], weighed)
    more = _weighed(pairs[run], beside(vehicle, found.candidate))
    if more and probability(nats(_best(more), found)) >= LIKELY:
        found = _best(more)
    # A change of sizes from one run to the other is the same change the other way round.
    return Judged(pairs[run], run if found.candidate.units else None, found, (*weighed, *more))


def _weighed(pair: Pair, candidates: Sequence[Candidate]) -> tuple[Weighed, ...]:
    return tuple(weigh(pair, candidate) for candidate in candidates)


def _named(weighed: Sequence[Weighed]) -> list[Weighed]:
    return [candidate for candidate in weighed if ANYTHING not in candidate.candidate.causes]


def _best(weighed: Sequence[Weighed]) -> Weighed:
    """The candidate with the smallest residual on pieces held out."""
    return min(weighed, key=lambda one: one.mean_square)
