"""Forward selection of causes: add one, swap, prune, as long as held-out evidence grows."""

from collections import Counter
from collections.abc import Callable, Collection, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from bridge.arrays import Array
from identify.diagnose.candidates import Cause, Setting, companions
from identify.diagnose.evidence import Evidence
from identify.diagnose.nominal import Nominal, refitted
from identify.diagnose.rhythms import seas_of
from identify.diagnose.weighing import CandidateEquations, Fitted, FormRemainder, Weighing, rows_of
from identify.effects.course import Course
from identify.effects.effect import Act, Effect
from identify.effects.environment import STEADY_CURRENT
from identify.threads import both, side_by_side

LEAST_GAIN, LEAST_SIGMA = 7.0, 1.0
"""Nats on held-out pieces, and standard errors of them, that a further cause must save among some forty candidates."""

LEAST_SEA_GAIN = 20.0
"""Nats that a sea must save: its periods were read off the whole dive, held-out pieces included."""

LEAST_SHARE = 0.01
"""Share of the nats saved by earlier causes, in the axes and pieces they share, that a further cause must exceed.

If the savings of the earlier causes' other forms are smaller, these are the limit. No form of a library is exact, and
a form's remainder grows with its evidence. A cause whose other forms save little is nearly exact.
"""

SHADOW, SHADOW_BEHIND_FILTER = 1e-3, 7e-3
"""Share of the nats saved by earlier causes that a further cause must exceed wherever it acts.

Forms right to a thirtieth of their force leave that much, and their other forms do not absorb it. Behind an
autopilot's filter, whose lateness and smoothing are fitted, they are right to a twelfth.
"""

NEXT_TO_NONE = 0.5
"""Nats of a form's remainder below which no bound is sharpened: half the chance gain of one parameter."""

LEAST_MOTION_NATS = 3.0
"""Nats that a cause must save in sample in the vehicle's motion: odds of twenty to one.

Shaft speeds identify and size a cause, but a cause that the motion does not show is an artefact of telemetry.
"""

LEAST_SWAP = 1.0

AMBIGUOUS_NATS = 3.0
"""Held-out nats within which two causes are ambiguous: odds of twenty to one."""

SAME_FORM = 1e-3
"""Share of a cause's nats that may come from its form alone. At tens of thousands of nats no form is exact enough for a
smaller margin to exclude a nearly equal cause."""

LOOKED_AT = 5
"""Best candidates fitted in full at fixed noise levels."""

WEIGHED = 30
"""Best candidates in sample that are weighed on held-out pieces."""

SETTINGS_OF_EACH = 4

SIMPLER_SHARE = 5e-3
"""Share of a one-parameter cause's nats that its form may leave to a cause of several parameters.

An attitude that is off by two degrees tilts a weight by as much.
"""

AT_END_NATS = 6.0
"""Nats by which a thruster that gives nothing at all must do better than a cause within its range: the best of some
eight comes near a weight in any dive."""

NEAR_SIGMA, FAR_LIKELIER = 5.0, 3.0
"""Standard errors of a gain that is not by chance, and times the required nats by which the filters must rise to make
up for a gain that is too small."""

CLIMB_SHARE = 0.1
"""Share of the nats saved at fixed noise levels that a climb of the filters may end short by."""

LATE_S = 0.02
"""Delay or lag of the thrust from which the search begins with it."""

MOST_CAUSES, MOST_TURNS, MOST_REFITS = 3, 7, 5
SETTLED = 1.0
LEAST_Z = 1.5


@dataclass(frozen=True)
class Explanation:
    """Result of the search: fitted causes, their weighing, and the filters without them."""

    fit: Fitted
    weighing: Weighing
    now: Nominal

    @property
    def causes(self) -> tuple[Cause, ...]:
        return self.fit.causes


def explain(
    nominal: Nominal, library: Sequence[Effect], progress: Callable[[float, str], None]
) -> Explanation:
    """Find the causes of a dive's gap among a library's effects, leaving out those that a refit of the model would
    absorb."""
    at = _weighing_maker(library)
    weighing, fit = _begun(nominal, at)
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
        if settled.now.log_posterior < weighing.now.log_posterior - _nats_uncertain(better, fit):
            # The nats saved at fixed noise levels are lost when the filters are fitted with the causes.
            if new:
                refused |= new
                continue
            if len(better.causes) == len(fit.causes):
                break
        weighing, fit, refused = settled, settled_fit, frozenset()
        if again:
            break
    judged = without_shadows_of_companions(weighing, fit)
    if len(judged.causes) < len(fit.causes):
        weighing, fit = _settled(nominal, weighing, judged, at)
    weighing, fit = _with_likeliest_timing(nominal, weighing, fit, at)
    weighing, fit = _with_usual_values(nominal, weighing, fit, at)
    return Explanation(fit, weighing, weighing.now)


def _likelier_with_one_more(
    nominal: Nominal,
    weighing: Weighing,
    fit: Fitted,
    refused: Collection[str],
    at: Callable[[Nominal, Sequence[Cause]], Weighing],
) -> tuple[Weighing, Fitted] | None:
    """The fit with the best further cause that saves too little at fixed noise levels, if the filters, fitted with it,
    are far likelier.

    Masses that were fitted without a Munk moment make up for most of it, and leave hardly any of it to be seen.
    """
    if not fit.causes or len(fit.causes) >= MOST_CAUSES:
        return None
    near = (
        cause
        for gain, sigma, cause in ranked_candidates(_beyond_all(weighing, fit), fit)
        if sigma > NEAR_SIGMA and gain > _least_gain(cause) and cause.effect.label not in refused
    )
    cause = next(near, None)
    if cause is None:
        return None
    count = len(fit.causes) + 1
    trial = weighing.fitted((*fit.causes, cause))
    if len(trial.causes) < count or trial.causes[-1].at_bound:
        return None
    settled, settled_fit = _settled(nominal, weighing, trial, at)
    rise = settled.now.log_posterior - weighing.now.log_posterior
    least = FAR_LIKELIER * required_gain(FormRemainder(weighing, fit), cause)
    return (settled, settled_fit) if rise > least and len(settled_fit.causes) == count else None


def _nats_uncertain(better: Fitted, fit: Fitted) -> float:
    """Nats by which the filters may be less likely with better causes, for no other reason than where a climb ends.

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
        taken = {each.key for each in _without(fit.causes, k)}
        for effect in weighing.library:
            other = Cause(effect, effect.none() + late_s)
            if not effect.timing or effect == cause.effect or other.key in taken:
                continue
            instead = (*fit.causes[:k], other, *fit.causes[k + 1 :])
            now = refitted(nominal, [each.act(weighing.now.course) for each in instead], weighing.now)
            near = at(now, instead)
            settled, settled_fit = _settled(nominal, near, near.fitted(instead), at)
            likelier = settled.now.log_posterior > best[0].now.log_posterior + AMBIGUOUS_NATS
            if likelier and len(settled_fit.causes) == len(fit.causes):
                best = settled, settled_fit
    return best


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
        others = weighing.fitted(_without(fit.causes, k))
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
        if now.log_posterior > best[0].now.log_posterior:
            near = at(now, (cause,))
            settled, fit = _settled(nominal, near, near.fitted((cause,)), at)
            if fit.causes and settled.now.log_posterior > best[0].now.log_posterior + LEAST_GAIN:
                best = settled, fit
    return best


def _late_thrust(nominal: Nominal, effects: Sequence[Effect]) -> Iterator[Cause]:
    """The late thrust that the dating of an autopilot's velocity found: columns of small delays don't reach it."""
    delay_s, lag_s = nominal.late_thrust_s
    timing, later_s = ("lag", lag_s) if lag_s > 0 else ("delay", delay_s)
    effect = next((candidate for candidate in effects if candidate.timing == timing), None)
    if effect is not None and later_s > LATE_S:
        yield Cause(effect, effect.none() + later_s)


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
        others = weighing.fitted(_without(fit.causes, k))
        accompanied = any(cause.effect.sea or cause.effect.companions for cause in others.causes)
        if not accompanied or fit.causes[k].effect.sea or fit.causes[k].effect.witnessed:
            continue
        tried = ranked_candidates(_beyond_all(weighing, others), others)
        gains = [gain for gain, _, cause in tried if cause.key == fit.causes[k].key]
        if max(gains, default=0.0) < required_gain(FormRemainder(weighing, others), fit.causes[k]):
            fit = others
    return fit


def _settled(
    nominal: Nominal, weighing: Weighing, fit: Fitted, at: Callable[[Nominal, Sequence[Cause]], Weighing]
) -> tuple[Weighing, Fitted]:
    """Refit causes and noise levels in turns until both agree; far faster than weighing all candidates each time.

    Turns that lead away from the filters' maximum are abandoned.
    """
    course = weighing.now.course
    # A current's course is among what is fitted, that of the water in waves is not.
    in_waves = any(cause.effect.sea and cause.act(course).water is None for cause in fit.causes)
    nominal = replace(nominal, joint=replace(nominal.joint, in_waves=in_waves))
    best: tuple[Weighing, Fitted] | None = None
    for _ in range(MOST_REFITS):
        now = refitted(nominal, [cause.act(weighing.now.course) for cause in fit.causes], weighing.now)
        if best is not None and now.log_posterior < best[0].now.log_posterior - AMBIGUOUS_NATS:
            return best
        weighing, before = at(now, fit.causes), fit
        fit = weighing.fitted(before.causes)
        if best is None or now.log_posterior > best[0].now.log_posterior:
            best = weighing, fit
        if _same(fit, before):
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
        elif fit.gain < _least_gain(fit.causes[0]) or not _shows_in_motion(
            fit, weighing.fitted(()), fit.causes[0]
        ):
            fit = weighing.fitted(())
    return fit


def _others_at_their_best(weighing: Weighing, fit: Fitted, k: int) -> Fitted:
    """All causes but the k-th, each in the variant that does best without it."""
    others = weighing.fitted(_without(fit.causes, k))
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
        others = weighing.fitted(_without(fit.causes, k))
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
    handicap = max(_least_gain(new) - _least_gain(cause), 0.0)
    by_form = _nats_for_simplicity(fit, others) * (_is_one_number(cause) - _is_one_number(new))
    by_form += AT_END_NATS * (_gives_nothing(new) - _gives_nothing(cause))
    return candidate.gain > fit.gain + handicap + (by_form or LEAST_SWAP)


def with_one_more(weighing: Weighing, fit: Fitted, refused: Collection[str] = ()) -> Fitted:
    """The fit with the best further candidate that other forms of the present causes do not replace."""
    remainder = FormRemainder(weighing, fit)
    able = [
        (gain, cause)
        for gain, sigma, cause in ranked_candidates(_beyond_all(weighing, fit), fit)
        if cause.effect.label not in refused
        and gain > _least_gain(cause) + _shadow_nats(remainder, cause)
        and sigma > LEAST_SIGMA
    ]
    required = side_by_side(lambda each: required_gain(remainder, each[1]), able)
    tried = [cause for (gain, cause), least in zip(able, required, strict=True) if gain > least]
    best = _simplest(_fits(weighing, fit, tried), fit)
    if best is not None and best.gain <= fit.gain + required_gain(remainder, best.causes[-1]):
        best = None
    return best or fit


def _beyond_all(weighing: Weighing, fit: Fitted) -> CandidateEquations:
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


def required_gain(remainder: FormRemainder, cause: Cause) -> float:
    """Nats that a further cause must save: chance, plus the form remainder of earlier causes."""
    return _least_gain(cause) + remainder_nats(remainder, cause)


def remainder_nats(remainder: FormRemainder, cause: Cause) -> float:
    """Nats that a further cause may save by the form remainder of earlier causes alone."""
    if cause.effect.witnessed or not remainder.fit.causes:
        return 0.0
    shadow = _shadow_nats(remainder, cause)
    share = LEAST_SHARE * min(remainder.overlap(cause), remainder.fit.motion_nats)
    return max(shadow, min(share, remainder.saved_overlap(cause)) if share > NEXT_TO_NONE else share)


def _shadow_nats(remainder: FormRemainder, cause: Cause) -> float:
    """Nats that a further cause may save by the form remainder of earlier causes, whatever it shares with them.

    Those of steady pushes count where it acts in the same degrees of freedom: the filters are fitted with trims, and a
    push without them saves far more than the dive tells of it.
    """
    fit = remainder.fit
    if cause.effect.witnessed or not fit.causes:
        return 0.0
    left = SHADOW_BEHIND_FILTER if remainder.weighing.now.filtered else SHADOW
    steady = fit.motion_nats - fit.unsteady_nats
    return left * max(fit.unsteady_nats + min(steady, remainder.overlap(cause)), 0.0)


def _least_gain(cause: Cause) -> float:
    return LEAST_SEA_GAIN if cause.effect.sea else LEAST_GAIN


def _shows_in_motion(fit: Fitted, others: Fitted, cause: Cause) -> bool:
    """Whether the motion supports a cause of `fit` over `others`."""
    return cause.effect.witnessed or fit.motion_nats - others.motion_nats > LEAST_MOTION_NATS


def _fits(weighing: Weighing, others: Fitted, tried: Sequence[Cause]) -> list[Fitted]:
    """Fits of the first candidates with the other causes, without candidates that show no effect or end at a bound."""
    fits = side_by_side(lambda cause: weighing.fitted((*others.causes, cause)), tried[:LOOKED_AT])
    fits = [
        candidate_fit
        for candidate_fit in fits
        if len(candidate_fit.causes) == len(others.causes) + 1 and candidate_fit.causes[-1].shows
    ]
    fits = [candidate_fit for candidate_fit in fits if not candidate_fit.causes[-1].at_bound]
    return [
        candidate_fit
        for candidate_fit in fits
        if _shows_in_motion(candidate_fit, others, candidate_fit.causes[-1])
    ]


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


def nats_apart(fit: Fitted, others: Fitted) -> float:
    """Nats within which another cause is as good as the last cause of `fit`."""
    return max(AMBIGUOUS_NATS, SAME_FORM * (fit.gain - others.gain))


def _nats_for_simplicity(fit: Fitted, others: Fitted) -> float:
    """Nats that a cause of several parameters has to save beyond a cause of a single parameter."""
    return max(AMBIGUOUS_NATS, SIMPLER_SHARE * (fit.gain - others.gain))


def _is_one_number(cause: Cause) -> bool:
    return len(cause.effect.parameters) == 1


def _gives_nothing(cause: Cause) -> bool:
    """Whether a cause is a thruster that gives nothing at all."""
    return cause.at_end and cause.effect.number > 0 and _is_one_number(cause)


def _without(causes: tuple[Cause, ...], k: int) -> tuple[Cause, ...]:
    return (*causes[:k], *causes[k + 1 :])


def ranked_candidates(
    candidates: CandidateEquations, fit: Fitted, most: int = WEIGHED
) -> list[tuple[float, float, Cause]]:
    """Gain, gain over its standard error, and cause, for the best setting of each candidate, best first.

    At most `most` settings are weighed, the best in sample, and few of each effect.
    """
    taken = {cause.key for cause in fit.causes}
    best: dict[str, tuple[float, float, Cause]] = {}
    untaken = [
        setting
        for setting in candidates.settings
        if (setting.effect.name, setting.effect.number) not in taken
    ]
    nats = candidates.equations.fitted([setting.columns for setting in untaken])
    weighed = _few_of_each([untaken[i] for i in np.argsort(-nats, kind="stable").tolist()])
    for setting in weighed[:most]:
        evidence, columns = weighed_setting(candidates, setting)
        cause = _cause(setting, columns, evidence.size)
        if not cause.shows:
            continue
        if evidence.gain > best.get(cause.effect.label, (-np.inf,))[0]:
            best[cause.effect.label] = evidence.gain, evidence.gain / max(evidence.std, 1e-12), cause
    return sorted(best.values(), key=lambda each: -each[0])


def _few_of_each(settings: Sequence[Setting]) -> list[Setting]:
    """The first settings of each effect, in order: an effect tried at many sizes leaves room for others."""
    count: Counter[str] = Counter()
    kept = []
    for setting in settings:
        count[setting.effect.label] += 1
        if count[setting.effect.label] <= SETTINGS_OF_EACH:
            kept.append(setting)
    return kept


def weighed_setting(candidates: CandidateEquations, setting: Setting) -> tuple[Evidence, tuple[int, ...]]:
    """Evidence of a setting without its insignificant columns."""
    columns = list(setting.columns)
    evidence = candidates.equations.evidence(columns)
    while len(columns) > 1:
        z = np.abs(evidence.size) / np.sqrt(np.maximum(np.diag(evidence.covariance), 1e-30))
        kept = [column for column, far in zip(columns, z.tolist(), strict=True) if far > LEAST_Z]
        if len(kept) == len(columns):
            break
        columns = kept or [columns[int(np.argmax(z))]]
        evidence = candidates.equations.evidence(columns)
    return evidence, tuple(columns)


def _cause(setting: Setting, columns: Sequence[int], size: Array) -> Cause:
    whole = np.zeros(len(setting.columns))
    whole[[setting.columns.index(column) for column in columns]] = size
    return setting.cause(whole)
