"""Forward selection of causes: add one, swap, prune, as long as held-out evidence grows."""

from collections.abc import Callable, Collection, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from identify.diagnose.causes.candidates import Cause
from identify.diagnose.causes.form_remainder import FormRemainder
from identify.diagnose.causes.ranking import ranked_candidates
from identify.diagnose.causes.requirement import (
    AMBIGUOUS_NATS,
    LEAST_GAIN,
    LEAST_SIGMA,
    least_gain,
    required_gain,
)
from identify.diagnose.causes.seas import seas_of
from identify.diagnose.causes.selection import MOST_CAUSES, beyond_all, improved, may_be_cause, without
from identify.diagnose.causes.weighing import Fitted, Weighing, rows_of
from identify.diagnose.filters.nominal import Nominal, refitted
from identify.effects.course import Course
from identify.effects.effect import Effect
from identify.effects.environment import STEADY_CURRENT
from identify.threads import both

Progress = Callable[[float, str], None]

NEAR_SIGMA, NEAR_SHARE = 5.0, 0.5
"""A cause whose gain is too small is still tried in the filters if the gain exceeds so many standard errors, or this
share of the required nats."""

FAR_LIKELIER, FAR_MORE = 3.0, 5.0
"""Times the required nats by which the filters must rise with it; or, if they rise by the required nats, times those
that it must save at the noise levels fitted with it. What another cause's form leaves over stays as large at these; a
cause that was taken for a disturbance grows."""

CLIMB_SHARE = 0.1
"""Share of the nats saved at fixed noise levels that a climb of the filters may end short by."""

LATE_S = 0.02
"""Delay or lag of the thrust from which the search begins with it."""

MOST_TURNS, MOST_REFITS, MOST_RISING = 10, 5, 20
"""Turns of the search; refits of causes and noise levels in turns, and those while each turn still makes the filters
likelier by LEAST_GAIN. Filters without a cause that sets in take it for a disturbance, and give it back in many small
turns."""

SETTLED = 1.0


@dataclass(frozen=True)
class Explanation:
    """Result of the search: fitted causes, their weighing, and the filters without them."""

    fit: Fitted
    weighing: Weighing
    now: Nominal

    @property
    def causes(self) -> tuple[Cause, ...]:
        return self.fit.causes


def explain(nominal: Nominal, library: Sequence[Effect], progress: Progress) -> Explanation:
    """Find the causes of a dive's gap among a library's effects, leaving out those that a refit of the model would
    absorb."""
    at = _weighing_maker(library)
    return _searched(nominal, at, *_begun(nominal, at), progress)


def explained_further(explanation: Explanation, nominal: Nominal, library: Sequence[Effect]) -> Explanation:
    """Go on from an explanation with a larger library."""
    at = _weighing_maker(library)
    weighing = at(explanation.now, explanation.causes)
    return _searched(nominal, at, weighing, weighing.fitted(explanation.causes), lambda *_: None)


def _searched(
    nominal: Nominal,
    at: Callable[[Nominal, Sequence[Cause]], Weighing],
    weighing: Weighing,
    fit: Fitted,
    progress: Progress,
) -> Explanation:
    been: list[tuple[str, ...]] = []
    refused: frozenset[str] = frozenset()
    held: frozenset[str] = frozenset()
    for turn in range(MOST_TURNS):
        progress((turn + 0.5) / (MOST_TURNS + 1), "weighing the candidates")
        better = improved(weighing, fit, refused)
        if not held <= {*_labels(better)}:
            # A cause that the filters need, and that saves too little at fixed noise levels.
            break
        if better.at == fit.at and _labels(better) == _labels(fit):
            likelier = _likelier_with_one_more(nominal, weighing, fit, refused, at)
            if likelier is None:
                break
            been.append(_labels(fit))
            held |= {*_labels(likelier[1])} - {*_labels(fit)}
            weighing, fit = likelier
            continue
        again = _labels(better) in been
        # A form remainder can make the search cycle: of two sets that lead to each other, the smaller.
        if again and len(better.causes) > len(fit.causes):
            break
        been.append(_labels(fit))
        progress((turn + 1.0) / (MOST_TURNS + 1), f"fitting {', '.join(_labels(better)) or 'none of them'}")
        settled, settled_fit = _settled(nominal, weighing, better, at)
        new = {*_labels(better)} - {*_labels(fit)}
        uncertain = _nats_uncertain(better, fit)
        if settled.now.log_posterior + uncertain < weighing.now.log_posterior and _lasting(
            nominal, settled, settled_fit
        ) + uncertain < _lasting(nominal, weighing, fit):
            # The nats saved at fixed noise levels are lost when the filters are fitted with the causes.
            if new:
                refused |= _refused_first(new, better, fit)
                continue
            if len(better.causes) == len(fit.causes):
                break
        weighing, fit, refused = settled, settled_fit, frozenset()
        held &= {*_labels(fit)}
        if again:
            break
    judged = without_shadows_of_companions(weighing, fit)
    if len(judged.causes) < len(fit.causes):
        weighing, fit = _settled(nominal, weighing, judged, at)
    weighing, fit = _with_likeliest_timing(nominal, weighing, fit, at)
    weighing, fit = _with_likeliest_variants(nominal, weighing, fit, at)
    weighing, fit = _with_usual_values(nominal, weighing, fit, at)
    return Explanation(fit, weighing, weighing.now)


def _likelier_with_one_more(
    nominal: Nominal,
    weighing: Weighing,
    fit: Fitted,
    refused: Collection[str],
    at: Callable[[Nominal, Sequence[Cause]], Weighing],
) -> tuple[Weighing, Fitted] | None:
    """The fit with the best further cause that saves too little at fixed noise levels, if the filters are far likelier
    once they are fitted with it, or likelier, and it saves far more then.

    The filters without a cause take it for a disturbance, or for other masses, and weigh down what would show it.
    """
    if not fit.causes or len(fit.causes) >= MOST_CAUSES:
        return None
    remainder = FormRemainder(weighing, fit)
    for gain, sigma, cause in ranked_candidates(beyond_all(weighing, fit), fit):
        if sigma <= LEAST_SIGMA or gain <= least_gain(cause) or cause.effect.label in refused:
            continue
        required = required_gain(remainder, cause)
        if sigma <= NEAR_SIGMA and gain <= NEAR_SHARE * required:
            continue
        trial = weighing.fitted((*fit.causes, cause))
        if len(trial.causes) == len(fit.causes) or not may_be_cause(trial.causes[-1], weighing):
            continue
        # Filters that are far less likely with it are at another maximum, which no settling leaves.
        least_likely = weighing.now.log_posterior - FAR_LIKELIER * required
        settled, settled_fit = _settled(nominal, weighing, trial, at, least_likely)
        if len(settled_fit.causes) <= len(fit.causes) or settled.now.log_posterior < least_likely:
            return None
        rise = _lasting(nominal, settled, settled_fit) - _lasting(nominal, weighing, fit)
        others = settled.fitted(settled_fit.causes[:-1])
        least = required_gain(FormRemainder(settled, others), settled_fit.causes[-1])
        grows = settled_fit.gain - others.gain > FAR_MORE * least
        likelier = rise > required if grows else rise > FAR_LIKELIER * required
        return (settled, settled_fit) if likelier else None
    return None


def _refused_first(new: set[str], better: Fitted, fit: Fitted) -> set[str]:
    """Of the new causes of better ones, by label, those to be tried no more: the further cause only if it is the only
    new one, because beside it another may have taken the place of a true cause."""
    further = {better.causes[-1].effect.label} if len(better.causes) > len(fit.causes) else set()
    return new - further or new


def _lasting(nominal: Nominal, weighing: Weighing, fit: Fitted) -> float:
    """Log posterior of the filters fitted once more with the causes they have.

    Right after a change of causes they still have drag and Coriolis forces at the speeds of the fit before, and may be
    likelier by that than they stay.
    """
    acts = [cause.act(weighing.now.course) for cause in fit.causes]
    return refitted(nominal, acts, weighing.now).log_posterior


def _nats_uncertain(better: Fitted, fit: Fitted) -> float:
    """Nats by which the filters may be less likely with better causes only because a climb ended early.

    A steady push makes them no likelier: the filters are fitted with trims, so that the disturbance takes none of it.
    """
    return max(AMBIGUOUS_NATS, CLIMB_SHARE * (better.gain - fit.gain))


def _with_likeliest_timing(
    nominal: Nominal, weighing: Weighing, fit: Fitted, at: Callable[[Nominal, Sequence[Cause]], Weighing]
) -> tuple[Weighing, Fitted]:
    """The fit with a late thrust of the form, a delay or a lag, with which the filters are likeliest.

    The rows are weighed by what the form that was found first leaves, and favour it: the shafts' rows most. The
    filters, fitted with each form, do not.
    """
    best = weighing, fit
    for k, cause in enumerate(fit.causes):
        if not cause.effect.timing:
            continue
        late_s = cause.values - cause.effect.none()
        taken = {each.key for each in without(fit.causes, k)}
        for effect in weighing.library:
            other = Cause(effect, effect.none() + late_s)
            if not effect.timing or effect == cause.effect or other.key in taken or not other.within_bounds:
                # Thrust that comes earlier than the vehicle file says is no delay.
                continue
            instead = (*fit.causes[:k], other, *fit.causes[k + 1 :])
            now = refitted(nominal, [each.act(weighing.now.course) for each in instead], weighing.now)
            near = at(now, instead)
            settled, settled_fit = _settled(nominal, near, near.fitted(instead), at)
            likelier = _by_pushed(settled.now) > _by_pushed(best[0].now) + AMBIGUOUS_NATS
            if likelier and len(settled_fit.causes) == len(fit.causes):
                best = settled, settled_fit
    return best


def _by_pushed(now: Nominal) -> float:
    """Log posterior of the filters without the readings of axes that no thruster pushes.

    A late thrust, or a current against which thrust holds, moves these by Coriolis forces alone. An error of the speeds
    that make them may be worth more there than the delay of a thrust is elsewhere.
    """
    return now.log_posterior - sum(
        problem.log_likelihood(now.theta[of_axis])
        for problem, of_axis in zip(now.joint.at(now.theta), now.joint.slices, strict=True)
        if problem.axis.dof in now.built.unpushed
    )


def _with_likeliest_variants(
    nominal: Nominal, weighing: Weighing, fit: Fitted, at: Callable[[Nominal, Sequence[Cause]], Weighing]
) -> tuple[Weighing, Fitted]:
    """The fit with each cause in the variant with which the filters are likeliest.

    Masses and dampings that were fitted without the cause, or with one of its variants, favour the variant that is
    most like their own errors: an inertia that is far too small looks like a righting moment that is too large.
    """
    for k in range(len(fit.causes)):
        cause, others = fit.causes[k], weighing.fitted(without(fit.causes, k))
        best = weighing, fit
        for effect in weighing.library:
            other = Cause(effect, effect.start())
            if other.key != cause.key or effect == cause.effect or not _is_variant(effect, cause.effect):
                continue
            instead = weighing.fitted((*fit.causes[:k], other, *fit.causes[k + 1 :]))
            saves = len(instead.causes) == len(fit.causes) and instead.gain > others.gain + AMBIGUOUS_NATS
            if not saves or not may_be_cause(instead.causes[k], weighing):
                continue
            least = best[0].now.log_posterior
            settled, settled_fit = _settled(nominal, weighing, instead, at, least)
            likelier = settled.now.log_posterior > least + AMBIGUOUS_NATS
            if likelier and len(settled_fit.causes) == len(fit.causes):
                best = settled, settled_fit
        weighing, fit = best
    return weighing, fit


def _is_variant(effect: Effect, of: Effect) -> bool:
    """Whether an effect of the same cause is another form of it, and not its beginning within the dive, or other
    periods of a sea."""
    within = (effect.since_s, effect.until_s) == (of.since_s, of.until_s)
    return within and not effect.sea and not effect.timing


def _with_usual_values(
    nominal: Nominal, weighing: Weighing, fit: Fitted, at: Callable[[Nominal, Sequence[Cause]], Weighing]
) -> tuple[Weighing, Fitted]:
    """The fit with a cause of unusual values replaced by the same effect elsewhere, if that does as well.

    Of two thrusters that push alike, one that is weak does as well as the other stronger with the whole hull heavier.
    Only fits with their own masses show that they are alike.
    """
    for k, cause in enumerate(fit.causes):
        if cause.usual:
            continue
        others = weighing.fitted(without(fit.causes, k))
        for _, _, other in ranked_candidates(weighing.candidates_with_fit(others), others):
            if other.effect.name == cause.effect.name and other.key != cause.key and other.usual:
                instead = weighing.fitted((*others.causes, other))
                settled, settled_fit = _settled(nominal, weighing, instead, at)
                alike = settled.now.log_posterior > weighing.now.log_posterior - AMBIGUOUS_NATS
                if alike and len(settled_fit.causes) == len(fit.causes) and settled_fit.causes[-1].usual:
                    return settled, settled_fit
    return weighing, fit


def _begun(nominal: Nominal, at: Callable[[Nominal, Sequence[Cause]], Weighing]) -> tuple[Weighing, Fitted]:
    """Start the search with no cause, or with one that is out of its reach and makes the filters likelier."""
    weighing = at(nominal, ())
    best = weighing, weighing.fitted(())
    for cause in (*_late_thrust(nominal, weighing.library), *_drift(nominal.course, weighing.library)):
        now = refitted(nominal, [cause.act(nominal.course)])
        if _by_pushed(now) > _by_pushed(best[0].now):
            near = at(now, (cause,))
            settled, fit = _settled(nominal, near, near.fitted((cause,)), at)
            if fit.causes and _by_pushed(settled.now) > _by_pushed(best[0].now) + LEAST_GAIN:
                best = settled, fit
    return best


def _late_thrust(nominal: Nominal, effects: Sequence[Effect]) -> Iterator[Cause]:
    """The late thrust that the dating of an autopilot's velocity found: columns of small delays don't reach it."""
    delay_s, lag_s = nominal.late_thrust_s
    timing, later_s = ("lag", lag_s) if lag_s > 0 else ("delay", delay_s)
    effect = next((candidate for candidate in effects if candidate.timing == timing), None)
    if effect is None or later_s <= LATE_S:
        return
    cause = Cause(effect, effect.none() + later_s)
    if not cause.within_stamps(nominal.stamped_s):
        yield cause


def _drift(course: Course, effects: Sequence[Effect]) -> Iterator[Cause]:
    """A current as fast as the vehicle is on average.

    A vehicle that drifts along needs hardly any thrust: fitted over ground, its drag is next to none, and with no drag
    no current makes a difference.
    """
    effect = next(
        (candidate for candidate in effects if candidate.model_part == STEADY_CURRENT.model_part), None
    )
    speed = course.nu[:, :3]
    mean = np.array([(way * speed).sum(axis=1)[course.recorded].mean() for way in course.world[:2]])
    if effect is not None and float(np.linalg.norm(mean)) > effect.parameters[0].start:
        yield Cause(effect, mean)


def without_shadows_of_companions(weighing: Weighing, fit: Fitted) -> Fitted:
    """The fit without causes that the companions of others replace, including causes found before these."""
    for k in range(len(fit.causes) - 1, -1, -1):
        others = weighing.fitted(without(fit.causes, k))
        accompanied = any(cause.effect.sea or cause.effect.companions for cause in others.causes)
        if not accompanied or fit.causes[k].effect.sea or fit.causes[k].effect.witnessed:
            continue
        tried = ranked_candidates(beyond_all(weighing, others), others)
        gains = [gain for gain, _, cause in tried if cause.key == fit.causes[k].key]
        if max(gains, default=0.0) < required_gain(FormRemainder(weighing, others), fit.causes[k]):
            fit = others
    return fit


def _settled(
    nominal: Nominal,
    weighing: Weighing,
    fit: Fitted,
    at: Callable[[Nominal, Sequence[Cause]], Weighing],
    least_likely: float = -np.inf,
) -> tuple[Weighing, Fitted]:
    """Refit causes and noise levels in turns until both agree; far faster than weighing all candidates each time.

    Turns that lead away from the filters' maximum are abandoned, and all of them after one that ends below the log
    posterior `least_likely`.
    """
    course = weighing.now.course
    # A current's course is among what is fitted, that of the water in waves is not.
    in_waves = any(cause.effect.sea and cause.act(course).water is None for cause in fit.causes)
    nominal = replace(nominal, joint=replace(nominal.joint, in_waves=in_waves))
    best: tuple[Weighing, Fitted] | None = None
    for turn in range(MOST_RISING):
        now = refitted(nominal, [cause.act(weighing.now.course) for cause in fit.causes], weighing.now)
        rise = np.inf if best is None else now.log_posterior - best[0].now.log_posterior
        if best is not None and now.log_posterior < best[0].now.log_posterior - AMBIGUOUS_NATS:
            return best
        weighing, before = at(now, fit.causes), fit
        fit = weighing.fitted(before.causes)
        if best is None or now.log_posterior > best[0].now.log_posterior:
            best = weighing, fit
        if _same(fit, before) or now.log_posterior < least_likely:
            break
        if turn + 1 >= MOST_REFITS and rise < LEAST_GAIN:
            break
    return weighing, fit


def explained_by(
    causes: Sequence[Cause], nominal: Nominal, library: Sequence[Effect], near: Nominal | None = None
) -> Explanation:
    """An explanation by the given causes alone, refitted with their noise levels.

    nominal: the filters without any cause; near: those from which the fit starts, of causes much like these. From the
    nominal ones, whose masses made up for the causes, it may end at a far lower maximum.
    """
    at = _weighing_maker(library)
    start = at(near or nominal, causes)
    weighing, fit = _settled(nominal, start, start.fitted(tuple(causes)), at)
    return Explanation(fit, weighing, weighing.now)


def _weighing_maker(library: Sequence[Effect]) -> Callable[[Nominal, Sequence[Cause]], Weighing]:
    """Weighing of a library's candidates, given filters and causes; seas take their periods from the dive."""
    able = tuple(effect for effect in library if effect.parameters and not effect.refit_absorbs)
    seas = {effect.name for effect in able if effect.sea}
    able = tuple(effect for effect in able if not effect.sea)

    def at(now: Nominal, causes: Sequence[Cause]) -> Weighing:
        of_causes = [cause.effect for cause in causes if cause.effect.sea]
        rows, of_seas = both(lambda: rows_of(now), lambda: seas_of(now))
        return Weighing(
            now, rows, (*able, *of_causes, *(effect for effect in of_seas if effect.name in seas))
        )

    return at


def _labels(fit: Fitted) -> tuple[str, ...]:
    return tuple(sorted(cause.effect.label for cause in fit.causes))


def _same(fit: Fitted, other: Fitted) -> bool:
    """Same causes, with values within a small part of their standard errors."""
    if _labels(fit) != _labels(other) or fit.at != other.at:
        return False
    std = np.sqrt(np.diag(fit.covariance))
    moved = np.array([fit.causes[k].values[p] - other.causes[k].values[p] for k, p in fit.at])
    return bool(np.all(np.abs(moved) < SETTLED * std))
