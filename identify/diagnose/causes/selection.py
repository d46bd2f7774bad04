"""Steps of the selection at fixed noise levels: prune, swap, add one cause."""

from collections.abc import Collection, Sequence

from identify.diagnose.causes.candidates import Cause, companions
from identify.diagnose.causes.form_remainder import FormRemainder
from identify.diagnose.causes.ranking import ranked_candidates
from identify.diagnose.causes.requirement import (
    AMBIGUOUS_NATS,
    LEAST_SIGMA,
    least_gain,
    required_gain,
    shadow_nats,
)
from identify.diagnose.causes.weighing import CandidateEquations, Fitted, Weighing
from identify.effects.effect import Act
from identify.threads import side_by_side

LEAST_MOTION_NATS = 3.0
"""Nats that a cause must save in sample in the vehicle's motion: odds of twenty to one.

Shaft speeds identify and size a cause, but a cause that the motion does not show is an artefact of telemetry.
"""

LEAST_SWAP = 1.0

LOOKED_AT = 5
"""Best candidates fitted in full at fixed noise levels."""

SIMPLER_SHARE = 5e-3
"""Share of a one-parameter cause's nats that its form may leave to a cause of several parameters.

An attitude that is off by two degrees tilts a weight by as much.
"""

AT_END_NATS = 6.0
"""Nats by which a thruster that gives nothing at all must do better than a cause within its range: the best of some
eight comes near a weight in any dive."""

MOST_CAUSES = 6


def improved(weighing: Weighing, fit: Fitted, refused: Collection[str] = ()) -> Fitted:
    """Prune, swap, and add at most one cause; `refused` causes, by label, are left out."""
    fit = swapped(weighing, pruned(weighing, fit), refused)
    return with_one_more(weighing, fit, refused) if len(fit.causes) < MOST_CAUSES else fit


def pruned(weighing: Weighing, fit: Fitted) -> Fitted:
    """The fit without causes that other forms of the remaining causes replace."""
    for k in range(len(fit.causes) - 1, -1, -1):
        if len(fit.causes) > 1:
            others = _others_at_their_best(weighing, fit, k)
            remainder = FormRemainder(weighing, others)
            tried = ranked_candidates(weighing.candidates_beyond_forms(others), others)
            gains = [
                gain for gain, sigma, cause in tried if cause.key == fit.causes[k].key and sigma > LEAST_SIGMA
            ]
            if max(gains, default=0.0) < required_gain(remainder, fit.causes[k]) or not _shows_in_motion(
                fit, others, fit.causes[k]
            ):
                fit = others
        elif fit.gain < least_gain(fit.causes[0]) or not _shows_in_motion(
            fit, weighing.fitted(()), fit.causes[0]
        ):
            fit = weighing.fitted(())
    return fit


def _others_at_their_best(weighing: Weighing, fit: Fitted, k: int) -> Fitted:
    """All causes but the k-th, each in the variant that does best without it."""
    others = weighing.fitted(without(fit.causes, k))
    for cause in others.causes:
        variants = {
            effect.label
            for effect in weighing.library
            if (effect.name, effect.number) == cause.key and effect.label != cause.effect.label
        }
        if variants:
            without_cause = weighing.fitted(tuple(item for item in others.causes if item.key != cause.key))
            tried = ranked_candidates(weighing.candidates_with_fit(without_cause), without_cause)
            fits = _fits(
                weighing, without_cause, [each for _, _, each in tried if each.effect.label in variants]
            )
            others = max((others, *fits), key=lambda each: each.gain)
    return others


def swapped(weighing: Weighing, fit: Fitted, refused: Collection[str] = ()) -> Fitted:
    """The fit with each cause replaced by a better cause given the others, if any.

    The better cause is another effect, or the same effect with other parameters.
    """
    for k in range(len(fit.causes)):
        if k >= len(fit.causes):
            break
        others = weighing.fitted(without(fit.causes, k))
        key = _form(fit.causes[k])
        tried = [
            cause
            for _, _, cause in ranked_candidates(weighing.candidates_with_fit(others), others)
            if _form(cause) != key and cause.effect.label not in refused
        ]
        fits = [new for new in _fits(weighing, others, tried) if _replaces(new, fit, fit.causes[k], others)]
        fit = _simplest(fits, others) or fit
    return fit


def _form(cause: Cause) -> tuple[str, bytes]:
    return cause.effect.label, cause.present.tobytes()


def _replaces(candidate: Fitted, fit: Fitted, cause: Cause, others: Fitted) -> bool:
    """Whether the last cause of `candidate` does better than `cause` in `fit`, or as well and is simpler.

    Another choice of parameters of the same cause has to exceed the margin for simplicity: a sea of two dozen
    parameters would never settle.
    """
    new = candidate.causes[-1]
    if new.effect.label == cause.effect.label:
        return candidate.gain > fit.gain + _nats_for_simplicity(fit, others)
    handicap = max(least_gain(new) - least_gain(cause), 0.0)
    by_form = _nats_for_simplicity(fit, others) * (_is_one_number(cause) - _is_one_number(new))
    by_form += AT_END_NATS * (_gives_nothing(new) - _gives_nothing(cause))
    return candidate.gain > fit.gain + handicap + (by_form or LEAST_SWAP)


def with_one_more(weighing: Weighing, fit: Fitted, refused: Collection[str] = ()) -> Fitted:
    """The fit with the best further candidate that other forms of the present causes do not replace."""
    remainder = FormRemainder(weighing, fit)
    able = [
        (gain, cause)
        for gain, sigma, cause in ranked_candidates(beyond_all(weighing, fit), fit)
        if cause.effect.label not in refused
        and gain > least_gain(cause) + shadow_nats(remainder, cause)
        and sigma > LEAST_SIGMA
    ]
    required = side_by_side(lambda each: required_gain(remainder, each[1]), able)
    tried = [cause for (gain, cause), least in zip(able, required, strict=True) if gain > least]
    best = _simplest(_fits(weighing, fit, tried), fit)
    if best is not None and best.gain <= fit.gain + required_gain(remainder, best.causes[-1]):
        best = None
    return best or fit


def beyond_all(weighing: Weighing, fit: Fitted) -> CandidateEquations:
    """All candidates, with the forms of a fit's causes, the companions of a sea, and those that an effect names as its
    own projected out.

    Waves also turn a hull as they push it, and a candidate that goes with the pitch rate would seem to explain all
    the waves that a few lines leave out. A tether also pulls upright, and a weight would seem to.
    """
    course, acts = weighing.now.course, list[Act]()
    for cause in fit.causes:
        if cause.effect.sea:
            acts += companions(course, cause)
        elif cause.effect.companions:
            acts += cause.effect.companions(course, cause.act(course))
    return weighing.candidates_beyond_forms(fit, acts)


def _shows_in_motion(fit: Fitted, others: Fitted, cause: Cause) -> bool:
    """Whether the motion supports a cause of `fit` over `others`."""
    return cause.effect.witnessed or fit.motion_nats - others.motion_nats > LEAST_MOTION_NATS


def _fits(weighing: Weighing, others: Fitted, tried: Sequence[Cause]) -> list[Fitted]:
    """Fits of the first candidates with the other causes, without candidates that show no effect, or that may be no
    cause."""
    fits = side_by_side(lambda cause: weighing.fitted((*others.causes, cause)), tried[:LOOKED_AT])
    fits = [
        candidate_fit
        for candidate_fit in fits
        if len(candidate_fit.causes) == len(others.causes) + 1
        and candidate_fit.causes[-1].shows
        and may_be_cause(candidate_fit.causes[-1], weighing)
    ]
    return [
        candidate_fit
        for candidate_fit in fits
        if _shows_in_motion(candidate_fit, others, candidate_fit.causes[-1])
    ]


def may_be_cause(cause: Cause, weighing: Weighing) -> bool:
    """Whether a fitted cause is within its bounds, possible in nature, and no mere error of the stamps."""
    now = weighing.now
    return not cause.at_bound and not cause.within_stamps(now.stamped_s) and cause.possible(now.course)


def _simplest(fits: Sequence[Fitted], others: Fitted) -> Fitted | None:
    """The best fit, or a fit with a one-parameter cause that does nearly as well: a weight rather than a push in any
    direction, and rather than a thruster that gives nothing at all, as near as that can come to a weight."""
    best = max(fits, key=lambda each: each.gain, default=None)
    if best is None:
        return None
    nats = _nats_for_simplicity(best, others)
    if _gives_nothing(best.causes[-1]):
        nats = max(nats, AT_END_NATS)
    return min(
        (fit for fit in fits if fit.gain > best.gain - nats),
        key=lambda each: (not _is_one_number(each.causes[-1]), each.causes[-1].at_end, -each.gain),
    )


def _nats_for_simplicity(fit: Fitted, others: Fitted) -> float:
    """Nats that a cause of several parameters has to save beyond a cause of a single parameter."""
    return max(AMBIGUOUS_NATS, SIMPLER_SHARE * (fit.gain - others.gain))


def _is_one_number(cause: Cause) -> bool:
    return len(cause.effect.parameters) == 1


def _gives_nothing(cause: Cause) -> bool:
    """Whether a cause is a thruster that gives nothing at all."""
    return cause.at_end and cause.effect.number > 0 and _is_one_number(cause)


def without(causes: tuple[Cause, ...], k: int) -> tuple[Cause, ...]:
    return (*causes[:k], *causes[k + 1 :])
