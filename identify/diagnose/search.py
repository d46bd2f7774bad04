"""Which causes: added one at a time, changed for better ones, as long as held-out pieces of the dive gain by it."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bridge.effects.effect import Effect
from identify.diagnose.candidates import Cause, Setting
from identify.diagnose.evidence import Evidence
from identify.diagnose.nominal import Nominal, refitted
from identify.diagnose.seas import SEAS, seas_of
from identify.diagnose.weighing import Beside, Fitted, Ground, Rest, ground_of

Array = NDArray[np.float64]

LEAST_GAIN, LEAST_SIGMA = 7.0, 1.0
"""Nats on held-out pieces, and their standard errors, that one more cause must save, among some forty tried."""

LEAST_SEA_GAIN = 30.0
"""The same of a sea, whose periods were looked for in all of the dive, the pieces held out among it."""

LEAST_SHARE = 0.01
"""A further cause must save this share of what those before it save where it shows itself, or else as much as other
forms of theirs would: no form of a library is quite true, and what a cause's form leaves grows with its evidence, in
the axes and at the times at which it acts. Where other forms of it save little, though, it is nearly true."""

NEXT_TO_NONE = 0.5
"""Nats of a form's rest that are not worth another look: half of what one parameter more saves by chance."""

LEAST_FELT = 3.0
"""Nats that a cause must save, in sample, where the vehicle moves: odds of twenty to one. Shaft speeds tell which cause
it is and how large, but one that the motion says nothing of is the telemetry's."""

LEAST_SWAP = 1.0
LOOKED_AT = 5
"""So many of the best candidates are fitted in full at the ground's noise levels."""

WEIGHED = 30
"""So many that fit best in sample are weighed on pieces held out."""

WITNESSED = {"imu_gravity_leak", "gyro_bias"}
"""What readings of their own tell, to which no form of another cause adds anything, with no need of the motion."""

MOST_CAUSES, MOST_TURNS, MOST_REFITS = 3, 7, 5
SETTLED = 1.0
LEAST_Z = 1.5


@dataclass(frozen=True)
class Explanation:
    """What the search came to: causes fitted on the last ground, the filters without them."""

    fit: Fitted
    ground: Ground
    now: Nominal

    @property
    def causes(self) -> tuple[Cause, ...]:
        return self.fit.causes


def explain(
    nominal: Nominal, library: Sequence[Effect], progress: Callable[[float, str], None]
) -> Explanation:
    """The causes of a dive's gap among the effects of a library that a refit of the nominal model leaves to be seen."""
    at = _grounds(library)
    ground = at(nominal, ())
    fit = ground.fitted(())
    been: list[tuple[str, ...]] = []
    for turn in range(MOST_TURNS):
        progress((turn + 0.5) / (MOST_TURNS + 1), "weighing the candidates")
        better = improved(ground, fit)
        if better.at == fit.at and _labels(better) == _labels(fit):
            break
        again = _labels(better) in been
        # A cause that comes and goes does so by what a form leaves: of two sets that lead to each other, the smaller.
        if again and len(better.causes) > len(fit.causes):
            break
        been.append(_labels(fit))
        progress((turn + 1.0) / (MOST_TURNS + 1), f"fitting {', '.join(_labels(better)) or 'none of them'}")
        ground, fit = _settled(nominal, ground, better, at)
        if again:
            break
    return Explanation(fit, ground, ground.now)


def _settled(
    nominal: Nominal, ground: Ground, fit: Fitted, at: Callable[[Nominal, Sequence[Cause]], Ground]
) -> tuple[Ground, Fitted]:
    """Causes that were found on one ground, on one of their own: their values and its noise levels in turns until these
    agree, which is far quicker than to weigh all others each time."""
    for _ in range(MOST_REFITS):
        now = refitted(nominal, [cause.act(ground.now.course) for cause in fit.causes], ground.now)
        ground, before = at(now, fit.causes), fit
        fit = ground.fitted(before.causes)
        if _same(fit, before):
            break
    return ground, fit


def explained_by(causes: Sequence[Cause], nominal: Nominal, library: Sequence[Effect]) -> Explanation:
    """These causes, each as large as the dive says, on a ground of their own; nominal: the filters without any."""
    now = refitted(nominal, [cause.act(nominal.course) for cause in causes])
    ground = _grounds(library)(now, causes)
    return Explanation(ground.fitted(tuple(causes)), ground, now)


def _grounds(library: Sequence[Effect]) -> Callable[[Nominal, Sequence[Cause]], Ground]:
    """Where the candidates of a library are weighed, given filters and causes; the seas among them are the dive's."""
    able = tuple(effect for effect in library if effect.parameters and not effect.refit_absorbs)
    seas = {effect.name for effect in able} & SEAS
    able = tuple(effect for effect in able if effect.name not in SEAS)

    def at(now: Nominal, causes: Sequence[Cause]) -> Ground:
        found = [cause.effect for cause in causes if cause.effect.name in SEAS]
        return ground_of(now, (*able, *found, *(effect for effect in seas_of(now) if effect.name in seas)))

    return at


def _labels(fit: Fitted) -> tuple[str, ...]:
    return tuple(sorted(cause.effect.label for cause in fit.causes))


def _same(one: Fitted, other: Fitted) -> bool:
    """The same causes, no value of which moved by much of its standard error."""
    if _labels(one) != _labels(other) or one.at != other.at:
        return False
    std = np.sqrt(np.diag(one.covariance))
    moved = np.array([one.causes[k].values[p] - other.causes[k].values[p] for k, p in one.at])
    return bool(np.all(np.abs(moved) < SETTLED * std))


def improved(ground: Ground, fit: Fitted) -> Fitted:
    """Without what is not needed, with better ones in place of others, and with at most one more."""
    fit = swapped(ground, pruned(ground, fit))
    return with_one_more(ground, fit) if len(fit.causes) < MOST_CAUSES else fit


def pruned(ground: Ground, fit: Fitted) -> Fitted:
    """Without causes that other forms of the rest would do as well as."""
    for k in range(len(fit.causes) - 1, -1, -1):
        if len(fit.causes) > 1:
            others = ground.fitted(_without(fit.causes, k))
            rest = Rest(ground, others)
            tried = candidates(ground.beyond(others), others)
            own = [
                gain for gain, sigma, cause in tried if cause.key == fit.causes[k].key and sigma > LEAST_SIGMA
            ]
            if max(own, default=0.0) < least(rest, fit.causes[k]) or not _felt(fit, others, fit.causes[k]):
                fit = others
        elif fit.gain < _alone(fit.causes[0]) or not _felt(fit, ground.fitted(()), fit.causes[0]):
            fit = ground.fitted(())
    return fit


def swapped(ground: Ground, fit: Fitted) -> Fitted:
    """Each cause for another that does better beside the rest."""
    for k in range(len(fit.causes)):
        if k >= len(fit.causes):
            break
        others = ground.fitted(_without(fit.causes, k))
        mine = fit.causes[k].effect.label
        tried = [
            cause for _, _, cause in candidates(ground.beside(others), others) if cause.effect.label != mine
        ]
        best = _best(ground, others, tried)
        if best is not None:
            handicap = max(_alone(best.causes[-1]) - _alone(fit.causes[k]), 0.0)
            if best.gain > fit.gain + handicap + LEAST_SWAP:
                fit = best
    return fit


def with_one_more(ground: Ground, fit: Fitted) -> Fitted:
    """With the best of the causes that no form of those there are makes up for."""
    rest = Rest(ground, fit)
    tried = [
        cause
        for gain, sigma, cause in candidates(ground.beyond(fit), fit)
        if gain > _alone(cause) and sigma > LEAST_SIGMA and gain > least(rest, cause)
    ]
    best = _best(ground, fit, tried)
    return best if best is not None and best.gain > fit.gain + least(rest, best.causes[-1]) else fit


def least(rest: Rest, cause: Cause) -> float:
    """Nats that one more cause must save: by chance, and by what the forms of those before it leave."""
    return _alone(cause) + left_to(rest, cause)


def left_to(rest: Rest, cause: Cause) -> float:
    """Nats that a further cause may save by what the forms of those before it leave."""
    if cause.effect.name in WITNESSED or not rest.fit.causes:
        return 0.0
    share = LEAST_SHARE * min(rest.met(cause), rest.fit.felt)
    return min(share, rest.seen(cause)) if share > NEXT_TO_NONE else share


def _alone(cause: Cause) -> float:
    return LEAST_SEA_GAIN if cause.effect.name in SEAS else LEAST_GAIN


def _felt(fit: Fitted, others: Fitted, cause: Cause) -> bool:
    """Whether the motion speaks for a cause that a fit has beside those of others."""
    return cause.effect.name in WITNESSED or fit.felt - others.felt > LEAST_FELT


def _best(ground: Ground, others: Fitted, tried: Sequence[Cause]) -> Fitted | None:
    fits = [ground.fitted((*others.causes, cause)) for cause in tried[:LOOKED_AT]]
    fits = [one for one in fits if len(one.causes) == len(others.causes) + 1 and one.causes[-1].shows]
    fits = [one for one in fits if _felt(one, others, one.causes[-1])]
    return max(fits, key=lambda one: one.gain, default=None)


def _without(causes: tuple[Cause, ...], k: int) -> tuple[Cause, ...]:
    return (*causes[:k], *causes[k + 1 :])


def candidates(beside: Beside, fit: Fitted, most: int = WEIGHED) -> list[tuple[float, float, Cause]]:
    """Gain, gain over its standard error, and cause, of the best setting of each candidate, best first.

    So many settings at most, those that fit best in sample, are weighed.
    """
    taken = {cause.key for cause in fit.causes}
    best: dict[str, tuple[float, float, Cause]] = {}
    able = [one for one in beside.settings if (one.effect.name, one.effect.number) not in taken]
    able.sort(key=lambda setting: -beside.sums.fitted(setting.columns))
    for setting in able[:most]:
        evidence, columns = weighed(beside, setting)
        cause = _cause(setting, columns, evidence.size)
        if not cause.shows:
            continue
        if evidence.gain > best.get(cause.effect.label, (-np.inf,))[0]:
            best[cause.effect.label] = evidence.gain, evidence.gain / max(evidence.std, 1e-12), cause
    return sorted(best.values(), key=lambda one: -one[0])


def weighed(beside: Beside, setting: Setting) -> tuple[Evidence, tuple[int, ...]]:
    """A setting less those of its columns that say nothing."""
    columns = list(setting.columns)
    evidence = beside.sums.evidence(columns)
    while len(columns) > 1:
        z = np.abs(evidence.size) / np.sqrt(np.maximum(np.diag(evidence.covariance), 1e-30))
        kept = [column for column, far in zip(columns, z.tolist(), strict=True) if far > LEAST_Z]
        if len(kept) == len(columns):
            break
        columns = kept or [columns[int(np.argmax(z))]]
        evidence = beside.sums.evidence(columns)
    return evidence, tuple(columns)


def _cause(setting: Setting, columns: Sequence[int], size: Array) -> Cause:
    whole = np.zeros(len(setting.columns))
    whole[[setting.columns.index(column) for column in columns]] = size
    return setting.cause(whole)
