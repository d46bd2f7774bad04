"""Causes that a dive can't tell apart: ambiguity groups, and the margin of a cause over its rivals."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from identify.diagnose.causes.candidates import Cause
from identify.diagnose.causes.confidence import LEAST_APART
from identify.diagnose.causes.evidence import inverse
from identify.diagnose.causes.form_remainder import FormRemainder
from identify.diagnose.causes.ranking import ranked_candidates
from identify.diagnose.causes.requirement import AMBIGUOUS_NATS, nats_apart, remainder_nats
from identify.diagnose.causes.search import Explanation, explained_by
from identify.diagnose.causes.selection import LOOKED_AT
from identify.diagnose.causes.weighing import Fitted, Weighing
from identify.diagnose.filters.nominal import Nominal
from identify.effects.effect import Effect

RIVALS = 2
"""Number of the best rivals of a doubtful cause that the filters are fitted with in its place."""

LEAST_LIKENESS = 0.5
"""Causes less alike than this are no ambiguity group even if either fits: both may be present."""


@dataclass(frozen=True)
class AmbiguityGroup:
    """Causes that can't be separated from a cause.

    names: causes that do as well; likeness: |cosine| of their columns with the cause's, nominal model and other
    causes projected out; margin_nats: gain over the best explanation without any of them, and over what the forms of
    the other causes may leave. thrusters: numbers of others of which the cause does as well.
    """

    names: tuple[str, ...]
    likeness: dict[str, float]
    margin_nats: float
    thrusters: tuple[int, ...] = ()


def ambiguity_of(explanation: Explanation, k: int) -> AmbiguityGroup:
    """The causes that this dive can't separate from the k-th, each fitted in its place."""
    fit, weighing = explanation.fit, explanation.weighing
    cause_k = fit.causes[k]
    others = weighing.fitted((*fit.causes[:k], *fit.causes[k + 1 :]))
    names: list[str] = []
    likeness: dict[str, float] = {}
    thrusters: set[int] = set()
    # The remainder of the other forms speaks against the presence of the cause, not against its name.
    best_apart = others.gain + remainder_nats(FormRemainder(weighing, others), cause_k)
    nearly = max(nats_apart(fit, others), LEAST_APART)
    for _, _, cause in ranked_candidates(weighing.candidates_with_fit(others), others)[:LOOKED_AT]:
        if cause.key == cause_k.key:
            continue
        tried = weighing.fitted((*others.causes, cause))
        if len(tried.causes) <= len(others.causes) or not tried.causes[-1].possible(weighing.now.course):
            continue
        is_same = cause.effect.name == cause_k.effect.name
        if tried.gain > fit.gain - nearly:
            alike = cosine(weighing, others, cause_k, tried.causes[-1])
            if is_same and alike >= LEAST_LIKENESS:
                thrusters.add(cause.effect.number)
            elif cause.effect.name not in names and alike >= LEAST_LIKENESS:
                names.append(cause.effect.name)
                likeness[cause.effect.name] = alike
        elif not is_same:
            best_apart = max(best_apart, tried.gain)
    return AmbiguityGroup(tuple(names), likeness, fit.gain - best_apart, tuple(sorted(thrusters)))


def absorbed_instead(
    explanation: Explanation, k: int, nominal: Nominal, library: Sequence[Effect]
) -> tuple[str, ...]:
    """The effect that the k-th cause may be instead (`Effect.may_be`), if the filters are as likely with that.

    The search does not try it, because a refit of masses and drags mostly takes it up.
    """
    cause = explanation.causes[k]
    if cause.effect.may_be is None or cause.effect.may_be[0] not in library:
        return ()
    effect, values_of = cause.effect.may_be
    others = (*explanation.causes[:k], *explanation.causes[k + 1 :])
    instead = (*others, Cause(effect, values_of(cause.values)))
    # With it the masses are others: near those of the cause there may be a lower maximum.
    likeliest = max(
        explained_by(instead, nominal, library, near).now.log_posterior for near in (None, explanation.now)
    )
    alike = likeliest > explanation.now.log_posterior - AMBIGUOUS_NATS
    return (effect.name,) if alike else ()


def margin_by_filters(explanation: Explanation, k: int, nominal: Nominal, library: Sequence[Effect]) -> float:
    """Nats by which the filters are likelier with all causes than with the k-th left out or replaced by its best rival.

    What the remainder of the other causes' forms may explain is subtracted. Unlike the regression, which stays at the
    masses and dampings that were found with the cause, this fits them anew without it; they then make up for a part.
    """
    cause = explanation.causes[k]
    without = explained_by(
        (*explanation.causes[:k], *explanation.causes[k + 1 :]), nominal, library, explanation.now
    )
    weighing, fit = without.weighing, without.fit
    best = without.now.log_posterior + remainder_nats(FormRemainder(weighing, fit), cause)
    rivals = [
        rival
        for _, _, rival in ranked_candidates(weighing.candidates_with_fit(fit), fit)
        if rival.effect.name != cause.effect.name
    ]
    for rival in rivals[:RIVALS]:
        best = max(best, explained_by((*fit.causes, rival), nominal, library, without.now).now.log_posterior)
    return explanation.now.log_posterior - best


def cosine(weighing: Weighing, others: Fitted, cause: Cause, other: Cause) -> float:
    """|cosine| of two causes' columns, with the nominal model and the slopes of `others` projected out."""
    course = weighing.now.course
    columns, nominal = (
        weighing.rows.columns([cause.act(course), other.act(course)], course),
        weighing.rows.nuisance,
    )
    known = nominal.with_columns(nominal.blocks_of(others.slopes))
    a, b = (columns - known.times(inverse(known.square()) @ known.crossed(columns))).T
    return float(abs(a @ b) / max(float(np.linalg.norm(a) * np.linalg.norm(b)), 1e-300))
