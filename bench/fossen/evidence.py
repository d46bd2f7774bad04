"""Which of the candidates two runs speak for, and how probable each cause is: by pieces that were held out."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

from bench.fossen.candidates import ALONE, ANYTHING, alone, beside
from bench.fossen.fit import Candidate, Pair, Weighed, weigh
from bench.fossen.runs import STATES, Columns
from identify.diagnose.probability import LIKELY, probability


@dataclass(frozen=True)
class Judged:
    """pair: the run that is taken to be plain, and the other. run: which one the other is, None where either may be it.
    found: the candidate that the runs speak for; weighed: all that were tried, on these runs."""

    pair: Pair
    run: str | None
    found: Weighed
    weighed: tuple[Weighed, ...]

    @property
    def verdict(self) -> str:
        """no_gap, explained, or unknown where it is no cause that has a name."""
        if self.found.candidate is ALONE:
            return "no_gap"
        return "unknown" if ANYTHING in self.found.candidate.causes else "explained"

    @property
    def probabilities(self) -> dict[str, float]:
        """Of each named cause: by how far the best candidate without it falls behind."""
        out = {}
        for cause in self.found.candidate.causes:
            without = [one for one in self.weighed if cause not in one.candidate.causes]
            out[cause] = min(probability(nats(self.found, one)) for one in without)
        return {cause: sure for cause, sure in out.items() if cause != ANYTHING}


def nats(one: Weighed, other: Weighed) -> float:
    """By how much one foretells what was held out better than the other.

    A piece counts once for each state: what is left remembers itself, and no longer than a piece lasts.
    """
    if not one.mean_square > 0:
        return math.inf if other.mean_square > 0 else 0.0
    ratio = other.mean_square / one.mean_square
    return 0.5 * len(STATES) * one.pieces * math.log(max(ratio, 1e-300))


def judged(vehicle: str, runs: dict[str, Columns]) -> Judged:
    """What one of the runs `a` and `b` holds that the other does not: one cause at a time, each in either run, then one
    more beside the best; each as long as pieces held out are likelier to gain by it than not."""
    pairs = {name: Pair(vehicle, runs[other], runs[name]) for name, other in ("ab", "ba")}
    tried = {name: _weighed(pair, alone(vehicle)) for name, pair in pairs.items()}
    # A plain run is explained by sizes of its own whatever the other is, which says nothing of which is the odd one.
    run = max(tried, key=lambda name: nats(_best(_named(tried[name])), tried[name][0]))
    weighed, found = tried[run], _best(tried[run])
    if probability(nats(found, weighed[0])) < LIKELY:
        return Judged(pairs[run], None, weighed[0], weighed)
    more = _weighed(pairs[run], beside(vehicle, found.candidate))
    if more and probability(nats(_best(more), found)) >= LIKELY:
        found = _best(more)
    # That the one run has other sizes than the other is the same the other way round.
    return Judged(pairs[run], run if found.candidate.units else None, found, (*weighed, *more))


def _weighed(pair: Pair, candidates: Sequence[Candidate]) -> tuple[Weighed, ...]:
    return tuple(weigh(pair, one) for one in candidates)


def _named(weighed: Sequence[Weighed]) -> list[Weighed]:
    return [one for one in weighed if ANYTHING not in one.candidate.causes]


def _best(weighed: Sequence[Weighed]) -> Weighed:
    """The one that leaves least of pieces held out."""
    return min(weighed, key=lambda one: one.mean_square)
