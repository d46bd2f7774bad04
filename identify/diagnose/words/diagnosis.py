"""A diagnosis in sentences, for the command, the app and the reports: verdict, gap, causes, shrink, next dive."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace

from identify.diagnose.result import (
    Character,
    Diagnosis,
    Finding,
    Next,
)
from identify.diagnose.shrink.contradiction import contradiction_clause, shown
from identify.diagnose.shrink.shrink import closed
from identify.diagnose.shrink.shrunk import CHANCE, LIKELY, Shrink
from identify.diagnose.verdict import swallowing
from identify.diagnose.words.causes import (
    SINCE,
    alike_words,
    cause_line,
    effect_words,
    name_of,
    percent_bounded,
    percents,
    words,
)
from identify.diagnose.words.drift import (
    DRIFT_S,
    _at_horizon,
    axis_words,
    changes,
    closes,
    level,
    of_dive,
)
from identify.diagnose.words.gap import gap_sentence, swallowed_sentence, where_sentence
from identify.words import capital, listed, significant


def cause_lines(diagnosis: Diagnosis) -> tuple[str, ...]:
    """A line per cause: name, probability, description, parameters and ambiguity."""
    return tuple(cause_line(finding) for finding in diagnosis.findings)


def next_lines(diagnosis: Diagnosis) -> tuple[str, ...]:
    """The way out of an accepted effect that has changed, then the next dive or sensor; empty without either."""
    dive = () if diagnosis.next is None else _next(diagnosis.next)
    return (*_way_out(diagnosis), *dive)


def _way_out(diagnosis: Diagnosis) -> tuple[str, ...]:
    likely, _ = sorted_by_likelihood(diagnosis.findings)
    changed = [each.cause.effect for each in likely if each.cause.effect.variant == SINCE]
    whole = {(each.name, each.number): each.parameters for each in diagnosis.accepted.effects}
    return tuple(
        f"{capital(effect_words(effect))}{_now(whole.get((effect.name, effect.number), {}))}: "
        + (
            "the vehicle makes up for it as it was. Accept and upload the new value, or roll back (seatrial params "
            "rollback)."
            if effect.compensation
            else "the model has it as it was. Accept the new value."
        )
        for effect in changed
        if effect.lasting
    )


def _now(parameters: Mapping[str, float]) -> str:
    """`, to gain 0.603`, by its parameters with the change included."""
    values = [f"{name} {significant(value)}" for name, value in parameters.items()]
    return f", to {listed(values)}" if values else ""


def _next(advice: Next) -> tuple[str, ...]:
    splits = f" It splits {listed([words(name) for name in advice.splits])}." if advice.splits else ""
    dive = f"Dive next: {'; '.join(advice.manoeuvres)}.{splits}" if advice.manoeuvres else ""
    sensor = f"Record as well: {'; '.join(advice.sensors)}." if advice.sensors else ""
    return tuple(line for line in (dive, sensor) if line)


NO_MORE = "no more than noise makes it by chance"

NO_SHRINK = "there is too little drift beyond noise to close"

VARIABLES = {"yaw_rate": "yaw rate", "thrust_sign": "the sign of the thrust"}

FRAMES = {
    "body": "fixed to the body",
    "world": "fixed to the world",
    "neither": "fixed to neither body nor world",
}

PARITIES = {"odd": "odd in speed", "even": "even in speed", "neither": "neither odd nor even in speed"}
SIGNS = {"odd": ": it turns its sign with it", "even": ": it keeps its sign", "neither": ""}


def verdict_sentence(diagnosis: Diagnosis) -> str:
    """The verdict with the gap's location and shrink, after warnings that invalidate it and before provisos."""
    return " ".join((*diagnosis.first, _verdict(diagnosis), *diagnosis.provisos))


def _verdict(diagnosis: Diagnosis) -> str:
    gap = diagnosis.gap
    if diagnosis.verdict == "no_gap":
        drift = f"the model's {DRIFT_S:g} s drift is {level(of_dive(gap))}"
        if gap.before > 1.0 + CHANCE:
            return f"Nothing that lasts: {drift}, but neither a candidate nor any force that returns explains it."
        return f"No gap: {drift}, {NO_MORE}, and no candidate explains any of it."
    likely, possible = sorted_by_likelihood(diagnosis.findings)
    if diagnosis.verdict == "unknown" and diagnosis.character is None and swallowing(gap.disturbance):
        return swallowed_sentence(gap.disturbance)
    if diagnosis.verdict == "unknown":
        part = f" {capital(_explain(likely, 'part of the gap'))}." if likely else ""
        part += f" {capital(_may_explain(possible, 'part of the gap'))}." if possible else ""
        if part and diagnosis.heldout is not None and diagnosis.heldout.at_most <= 0:
            which = "them" if len(diagnosis.findings) > 1 else "it"
            part = (
                f" It looks like {_all(diagnosis.findings)}, but with {which} the drift does not shrink on pieces "
                "held out."
            )
        part = f"{part[:-1]}{contradiction_clause(diagnosis.heldout, diagnosis.check)}." if part else ""
        return f"Something is there that no candidate explains: {_unexplained(diagnosis, 'it')}.{part}"
    alike = [
        f"{effect_words(cause.cause.effect)} from {' or '.join(alike_words(cause))}"
        for cause in likely
        if cause.is_ambiguous
    ]
    doubt = f", but this dive can't tell {listed(alike)}" if alike else ""
    partly = diagnosis.verdict == "partly"
    no_gap = not partly and _opens_no_gap(diagnosis)
    if not likely:
        causes = _may_explain(possible, "what shows" if no_gap else "the gap")
    else:
        causes = (
            f"{_all(likely)} {_shows(likely)}"
            if no_gap
            else _explain(likely, "part of the gap" if partly else "the gap")
        )
        causes += doubt
        if possible:
            causes += f"; {_may_explain(possible, 'some of what shows' if no_gap else 'some of it, too')}"
    # One "but" a sentence.
    causes += contradiction_clause(diagnosis.heldout, diagnosis.check, "and" if doubt else "but")
    drift = _drift_clause(diagnosis, "them" if len(diagnosis.findings) > 1 else "it", no_gap)
    where = where_sentence(gap, "what shows") if no_gap else gap_sentence(gap)
    said = f"{drift}. {capital(where)}" if drift else where
    return f"{capital(causes)}: {said}.{_remainder(diagnosis) if partly else ''}"


def shown_note(shown: Sequence[Finding]) -> tuple[str, ...]:
    """A sentence on causes that show beside accepted effects and open no gap; empty without any."""
    if not shown:
        return ()
    causes = [f"{effect_words(cause.cause.effect)} ({percent_bounded(cause.probability)})" for cause in shown]
    return (
        f"Beside what was accepted {listed(causes)} {_shows(shown)}: no more than its values or the thrust "
        "curve are unsure by.",
    )


def _shows(causes: Sequence[Finding]) -> str:
    return "show, but open no gap" if len(causes) > 1 else "shows, but opens no gap"


def _remainder(diagnosis: Diagnosis) -> str:
    """Sentence on the part of the gap that the accepted causes leave."""
    left = diagnosis.gap.unexplained
    share = (
        f", {percent_bounded(left)} of the drift beyond noise on pieces held out"
        if math.isfinite(left)
        else ""
    )
    return f" Something is left that no candidate explains{share}: {_unexplained(diagnosis, 'that')}."


def _unexplained(diagnosis: Diagnosis, whole: str) -> str:
    """Location and character of the unexplained remainder. It lies in the degrees of freedom in which it acts,
    without a phase where the gap has no share in them."""
    gap = diagnosis.gap
    if gap.unexplained_where:
        gap = replace(gap, where=gap.unexplained_where, slices=())
    if diagnosis.character is None:
        return where_sentence(gap, whole)
    acts_in = diagnosis.character.dof
    of_it = [item for item in gap.where if item.dof in acts_in]
    total = sum(item.share for item in of_it)
    if total > 0:
        gap = replace(gap, where=tuple(replace(item, share=item.share / total) for item in of_it))
    lies = where_sentence(gap, whole) if total > 0 or not acts_in else f"{whole} lies in {listed(acts_in)}"
    return f"{lies}; {_character_clause(diagnosis.character)}"


def sorted_by_likelihood(findings: Sequence[Finding]) -> tuple[tuple[Finding, ...], tuple[Finding, ...]]:
    """Likely causes, and possible ones."""
    likely = tuple(cause for cause in findings if cause.probability >= LIKELY)
    return likely, tuple(cause for cause in findings if cause.probability < LIKELY)


def _explain(findings: Sequence[Finding], gap: str) -> str:
    return f"{_all(findings)} {'explain' if len(findings) > 1 else 'explains'} {gap}"


def _may_explain(findings: Sequence[Finding], gap: str) -> str:
    """Clause on possible causes: `thrust bias or DVL bias (42 % probable) may explain some of it, too`."""
    named = listed(
        [f"{name_of(cause)} ({percent_bounded(cause.probability)} probable)" for cause in findings]
    )
    return f"{named} may explain {gap}"


def shrink_lines(diagnosis: Diagnosis) -> tuple[str, ...]:
    """Drift over the whole dive, and how much of it closes on held-out pieces and on the check dive; on the check dive,
    or else on held-out pieces, by degree of freedom first.
    """
    fitted = _whole_dive(diagnosis)
    whole = (f"Over the whole dive, which was fitted: {fitted}.",) if fitted else ()
    shrinks = [
        (where, each)
        for where, each in (("On pieces held out", diagnosis.heldout), ("On the check dive", diagnosis.check))
        if each is not None
    ]
    by_axis = [
        f"{where}, {axis.dof}: {axis_words(axis)}." for where, each in shrinks[-1:] for axis in each.by_axis
    ]
    return (*whole, *by_axis, *(f"{where}, all together: {_shrink(each)}." for where, each in shrinks))


def character_lines(diagnosis: Diagnosis) -> tuple[str, ...]:
    """A line on the character of the unexplained remainder, if any."""
    character = diagnosis.character
    if character is None:
        return ()
    goes = (
        f"It goes with {listed([variable(v) for v in character.depends_on])}." if character.depends_on else ""
    )
    sentences = (
        "What no candidate explains:",
        f"It acts in {listed(character.dof)}." if character.dof else "",
        f"It is {FRAMES[character.frame]}.",
        f"It is {PARITIES[character.parity]}{SIGNS[character.parity]}.",
        f"In time it is {character.timing}.",
        goes,
    )
    return (" ".join(filter(None, sentences)),)


def variable(name: str) -> str:
    """A variable's name in words."""
    return VARIABLES.get(name, name)


def _character_clause(character: Character) -> str:
    goes = (
        f", and goes with {listed([variable(v) for v in character.depends_on])}"
        if character.depends_on
        else ""
    )
    return f"it is {FRAMES[character.frame]}, {PARITIES[character.parity]}, {character.timing}{goes}"


def _shrink(shrink: Shrink) -> str:
    if not math.isfinite(shrink.value):
        return NO_SHRINK
    interval = percents(shrink.low95, shrink.high95)
    interval_words = f" (95 %: {interval})" if interval else ""
    return f"the model with the causes {closes(shrink.value)}{interval_words} of the {DRIFT_S:g} s drift beyond noise"


def _whole_dive(diagnosis: Diagnosis) -> str:
    """Clause on the drift of the gap over the whole dive, before and after; "" without causes."""
    if not diagnosis.findings or _at_horizon(diagnosis.gap.after) is None:
        return ""
    moved = changes(of_dive(diagnosis.gap))
    return f"the {DRIFT_S:g} s drift {moved}" if moved else ""


def _drifts(diagnosis: Diagnosis) -> tuple[Shrink, str] | None:
    """Drift before and after, and its source by best evidence: check dive if that shows the causes, held-out pieces,
    the dive itself."""
    if diagnosis.check is not None and shown(diagnosis.heldout, diagnosis.check):
        return diagnosis.check, " on the check dive"
    if diagnosis.heldout is not None:
        return diagnosis.heldout, " on pieces held out"
    before, after = diagnosis.gap.before, _at_horizon(diagnosis.gap.after)
    if after is None:
        return None
    share = closed(before, after.total)
    return Shrink(before, after.total, share, math.nan, math.nan, by_axis=of_dive(diagnosis.gap)), ""


def _opens_no_gap(diagnosis: Diagnosis) -> bool:
    """Whether the drift is within noise, so that there is no gap to shrink."""
    drift = _drifts(diagnosis)
    if drift is None or max(drift[0].before, diagnosis.gap.before) > 1.0 + CHANCE:
        return False
    return not math.isfinite(drift[0].value)


def _drift_clause(diagnosis: Diagnosis, causes: str, no_gap: bool) -> str:
    """Clause on the change of the drift."""
    drifts = _drifts(diagnosis)
    if drifts is None:
        return ""
    shrink, where = drifts
    within = f", {NO_MORE}" if shrink.before <= 1.0 + CHANCE else ""
    drift = f"the model's {DRIFT_S:g} s drift"
    if all(cause.cause.effect.acts_on == "log" for cause in diagnosis.findings):
        return (
            f"it shows in what is recorded, not in the motion: with {causes} or without, {drift} is "
            f"{level(shrink.by_axis, before=False)}{where}{within}"
        )
    if significant(shrink.before, 2) == significant(shrink.after, 2):
        return f"with {causes} or without, {drift} is {level(shrink.by_axis, before=False)}{where}{within}"
    moved = changes(shrink.by_axis)
    if not moved:
        without, mended = level(shrink.by_axis), level(shrink.by_axis, before=False)
        return f"without {causes} {drift} is {without}, with {causes} {mended}{where}{within}"
    # The share is of every degree of freedom, and those that are named may close more, or less, of their own.
    share = f", which {closes(shrink.value)} of what is beyond noise, all together"
    gone = share if math.isfinite(shrink.value) else ""
    return f"with {causes} {drift} {moved}{where}{'' if no_gap else gone}{within}"


def _all(findings: Sequence[Finding]) -> str:
    return listed([name_of(cause) for cause in findings])
