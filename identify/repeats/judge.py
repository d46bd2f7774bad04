"""Which effect moved the marks of further runs away from those of the accepted ones.

The mean of n further runs scatters by the accepted runs' scatter over n, and the accepted mean by it over their number.
Each effect is weighed by its evidence: the likelihood of the mean shift, averaged over the effect's sizes and over the
directions that the vehicle file leaves open, against that of no shift (Bayes factor).
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from identify.diagnose import candidates
from identify.diagnose.result import Finding, Value, Verdict
from identify.dive import Array
from identify.repeats.causes import Cause
from identify.repeats.usual import MARKS, Usual

LEAST_NATS: Final = 3.0
"""Evidence below which nothing is named."""

ALIKE_NATS: Final = 2.0
"""Effects whose evidence is closer than this to the best one's can't be told from it."""

LEAST_CLOSED: Final = 1 / 3
"""Share of the squared shift that a cause has to explain where it leaves something; else the answer is `unknown`."""

FAR: Final = 3.0
"""Standard deviations from which a single mark is told as odd."""

LEAST: Final = 1e-9
ODD_SQUARE: Final = 25.7
"""Square of the five marks' shift that chance exceeds once in ten thousand (chi-squared)."""


@dataclass(frozen=True)
class Judged:
    """The answer for several runs together.

    verdict: as in a diagnosis. finding: the cause, None for none. evidence: nats by label of each candidate. shift
    (5,): of each mark, in its unit; off (5,): in standard deviations of a mean of so many runs. unexplained: share of
    the squared shift that is left, 0 if chance would leave as much. left: the marks in which something is left that
    the cause does not explain.
    """

    runs: int
    verdict: Verdict
    finding: Finding | None
    evidence: dict[str, float]
    shift: Array
    off: Array
    unexplained: float
    left: tuple[str, ...]


def judge(marks: Array, usual: Usual, causes: Mapping[str, Sequence[Cause]]) -> Judged:
    """Judge the marks (n, 5) of further runs."""
    shift = marks.mean(axis=0) - usual.mean
    scatter = usual.scatter * (1.0 / len(marks) + 1.0 / usual.count)
    none = _log_likelihood(shift, scatter)
    each = {
        label: np.array(
            [_log_likelihood(shift - c.shift, scatter + np.diag(c.rough**2)) - none for c in sizes]
        )
        for label, sizes in causes.items()
    }
    nats = {label: float(np.logaddexp.reduce(of) - np.log(len(of))) for label, of in each.items()}
    best = max(nats, key=lambda label: nats[label])
    cause = causes[best][int(np.argmax(each[best]))]
    odd = _odd(shift - cause.shift, scatter + np.diag(cause.rough**2))
    # A direction that is left open may fit a cause to another's shift: here it does not count.
    unexplained = min(_square(shift - cause.shift, scatter) / max(_square(shift, scatter), LEAST), 1.0)
    off = shift / np.sqrt(np.diag(scatter))
    if nats[best] < LEAST_NATS or (odd and unexplained > 1.0 - LEAST_CLOSED):
        odd = _odd(shift, scatter)
        return Judged(
            len(marks), "unknown" if odd else "no_gap", None, nats, shift, off, float(bool(odd)), odd
        )
    name_of = {label: causes[label][0].effect.name for label in nats}
    near = [name_of[label] for label in nats if nats[best] - nats[label] < ALIKE_NATS]
    also = tuple(dict.fromkeys(name for name in (*cause.also, *near) if name != cause.effect.name))
    named = [nats[label] for label in nats if name_of[label] in (cause.effect.name, *also)]
    finding = Finding(
        candidates.Cause(cause.effect, cause.values),
        also,
        dict.fromkeys(cause.also, 1.0),
        float(np.exp(np.logaddexp.reduce(named) - np.logaddexp.reduce([0.0, *nats.values()]))),
        _parameters(causes[best], each[best]),
        nats[best],
    )
    verdict: Verdict = "ambiguous" if also else "partly" if odd else "explained"
    return Judged(len(marks), verdict, finding, nats, shift, off, unexplained if odd else 0.0, odd)


def _log_likelihood(off: Array, covariance: Array) -> float:
    _, log_volume = np.linalg.slogdet(covariance)
    return -0.5 * (_square(off, covariance) + float(log_volume))


def _square(off: Array, covariance: Array) -> float:
    return float(off @ np.linalg.solve(covariance, off))


def _odd(left: Array, covariance: Array) -> tuple[str, ...]:
    """The marks that are off by more than chance, if all together are."""
    if _square(left, covariance) < ODD_SQUARE:
        return ()
    far = np.abs(left) > FAR * np.sqrt(np.diag(covariance))
    return tuple(name for name, is_far in zip(MARKS, far, strict=True) if is_far) or MARKS


def _parameters(sizes: Sequence[Cause], nats: Array) -> dict[str, Value]:
    """The effect's parameters in the middle of its evidence, with 95 % of it between the ends."""
    effect = sizes[0].effect
    value = np.array([cause.values[0] for cause in sizes])
    order = np.argsort(value)
    share = np.cumsum(np.exp(nats[order] - np.logaddexp.reduce(nats)))
    low, middle, high = (
        np.array([value[order][min(int(np.searchsorted(share, at)), len(value) - 1)]])
        for at in (0.025, 0.5, 0.975)
    )
    ends = effect.told(low), effect.told(high)
    return {
        name: Value(told, unit, ends[0][name][0], ends[1][name][0])
        for name, (told, unit) in effect.told(middle).items()
    }
