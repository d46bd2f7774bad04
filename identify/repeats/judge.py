"""Which effect moved the marks of further runs away from those of the accepted ones.

The mean of n further runs scatters by the accepted runs' scatter over n, and the accepted mean by it over their number.
Each effect is weighed by its evidence: the likelihood of the mean shift, averaged over the effect's sizes and over what
the vehicle file does not know of its direction, against that of no shift (Bayes factor).
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Final, Literal

import numpy as np
from scipy.special import logsumexp
from scipy.stats import chi2

from identify.diagnose.result import Value
from identify.dive import Array
from identify.repeats.causes import Cause
from identify.repeats.usual import MARKS, Usual
from identify.statistics import Z95

LEAST_NATS: Final = 3.0
"""Evidence below which nothing is named."""

ALIKE_NATS: Final = 2.0
"""Effects whose evidence is closer than this to the best one's can't be told from it."""

ODD: Final = 1e-4
"""Probability below which the marks that a cause leaves over are told as something else."""


@dataclass(frozen=True)
class Judged:
    """The answer for several runs together. verdict: as in a diagnosis. effect: the cause's name, "" for none; also:
    others that the marks can't tell from it. parameters: of the cause. evidence: nats by label. off (5,): shift of each
    mark in standard deviations of a mean of so many runs. left: the marks in which something is left that the cause
    does not explain."""

    verdict: Literal["no_gap", "explained", "partly", "ambiguous", "unknown"]
    effect: str
    also: tuple[str, ...]
    probability: float
    parameters: dict[str, Value]
    evidence: dict[str, float]
    off: dict[str, float]
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
    nats = {label: float(logsumexp(of) - np.log(len(of))) for label, of in each.items()}
    off = dict(zip(MARKS, (shift / np.sqrt(np.diag(scatter))).tolist(), strict=True))
    best = max(nats, key=lambda label: nats[label])
    if nats[best] < LEAST_NATS:
        odd = _odd(shift, scatter)
        return Judged("unknown" if odd else "no_gap", "", (), 0.0, {}, nats, off, odd)
    cause = causes[best][int(np.argmax(each[best]))]
    alike = tuple(
        dict.fromkeys(
            causes[label][0].effect.name
            for label in nats
            if nats[best] - nats[label] < ALIKE_NATS and causes[label][0].effect.name != cause.effect.name
        )
    )
    odd = _odd(shift - cause.shift, scatter + np.diag(cause.rough**2))
    named = [label for label in nats if causes[label][0].effect.name in (cause.effect.name, *alike)]
    against = logsumexp([0.0, *nats.values()])
    return Judged(
        "ambiguous" if alike else "partly" if odd else "explained",
        cause.effect.name,
        alike,
        float(np.exp(logsumexp([nats[label] for label in named]) - against)),
        _parameters(causes[best], each[best]),
        nats,
        off,
        odd,
    )


def _log_likelihood(off: Array, covariance: Array) -> float:
    _, log_volume = np.linalg.slogdet(covariance)
    return -0.5 * float(off @ np.linalg.solve(covariance, off) + log_volume)


def _odd(left: Array, covariance: Array) -> tuple[str, ...]:
    """The marks that are off by more than chance, if all together are."""
    together = float(left @ np.linalg.solve(covariance, left))
    if chi2.sf(together, len(left)) > ODD:
        return ()
    far = np.abs(left) > Z95 * np.sqrt(np.diag(covariance))
    return tuple(name for name, is_far in zip(MARKS, far, strict=True) if is_far) or MARKS


def _parameters(sizes: Sequence[Cause], nats: Array) -> dict[str, Value]:
    """The effect's parameters in the middle of what the evidence allows, with 95 % of it between the ends."""
    effect = sizes[0].effect
    value = np.array([cause.values[0] for cause in sizes])
    order = np.argsort(value)
    share = np.cumsum(np.exp(nats[order] - logsumexp(nats)))
    low, middle, high = (
        np.array([value[order][min(int(np.searchsorted(share, at)), len(value) - 1)]])
        for at in (0.025, 0.5, 0.975)
    )
    ends = effect.told(low), effect.told(high)
    return {
        name: Value(told, unit, ends[0][name][0], ends[1][name][0])
        for name, (told, unit) in effect.told(middle).items()
    }
