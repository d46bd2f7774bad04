"""The verdict of a diagnosis in sentences: causes, location of the gap, shrink, character of the unexplained."""

import math
from collections.abc import Sequence
from dataclasses import replace

from identify.diagnose.gap import LEAST_SPEED_M_S
from identify.diagnose.result import Character, Diagnosis, Finding, Gap, Phase, Share, Shrink
from identify.diagnose.shrink import CHANCE, LEAST_GAP, contradiction_clause
from identify.diagnose.verdict import LIKELY, swallowing
from identify.diagnose.wording import (
    DRIFT_S,
    axis_lines,
    changes,
    effect_words,
    name_of,
    percent,
    percent_sure,
    percents,
    swallowed_sentence,
    words,
)
from identify.words import capital, fixed, listed, significant

MOST_OF_IT = 0.75
"""Share of a degree of freedom's gap above a speed, for `mostly above`."""

MOST_OF_THAT = 0.5
"""Share of a degree of freedom's gap in one phase, for `most of that`."""

STANDS_OUT = 0.4
"""Share of the gap from which a degree of freedom and a phase are named together."""

PHASES: dict[Phase, str] = {
    "rest": "at rest",
    "accelerating": "accelerating",
    "decelerating": "decelerating",
    "steady": "steady",
    "turning": "turning",
    "reversing": "reversing",
}

BY_CHANCE = f"1 ({1 - CHANCE:g} to {1 + CHANCE:g} by chance)"
"""Drift by noise alone, in floors."""

NO_SHRINK = "there is too little gap to shrink"

VARIABLES = {"yaw_rate": "yaw rate", "thrust_sign": "the sign of the thrust"}

FRAMES = {
    "body": "fixed to the body",
    "world": "fixed to the world",
    "neither": "fixed to neither body nor world",
}

PARITIES = {
    "odd": "odd in speed: it turns its sign with it",
    "even": "even in speed: it keeps its sign",
    "neither": "neither odd nor even in speed",
}


def where_lines(diagnosis: Diagnosis, most: int = 3) -> tuple[str, ...]:
    """The largest parts of the squared gap, `71 % surge, steady`, at most `most`."""
    largest = sorted(diagnosis.gap.where, key=lambda one: -one.share)[:most]
    return tuple(
        f"{percent(item.share)} {item.dof}, {PHASES[item.phase]}" for item in largest if item.share >= 0.005
    )


def gap_sentence(gap: Gap, whole: str = "it") -> str:
    """Location of the gap: by drift, its measure, if the drift lies in another degree of freedom than the force."""
    by_force = where_sentence(gap, whole)
    if not drifts_elsewhere(gap):
        return by_force
    by_drift = where_sentence(replace(gap, where=gap.drifted, slices=()), whole)
    return f"by drift {by_drift} (by force {where_sentence(replace(gap, slices=()), whole)})"


def where_sentence(gap: Gap, whole: str = "it") -> str:
    """`71 % of it is in surge, steady, mostly above 0.3 m/s`; `whole` names the total."""
    if not gap.where:
        return "no degree of freedom was compared"
    first = max(gap.where, key=lambda one: one.share)
    if first.share >= STANDS_OUT:
        return f"{percent(first.share)} of {whole} is in {first.dof}, {PHASES[first.phase]}{_above(gap, first.dof)}"
    by_dof = shares_by_dof(gap.where)
    dof = max(by_dof, key=lambda name: by_dof[name])
    of_dof = [item for item in gap.where if item.dof == dof]
    largest = max(of_dof, key=lambda one: one.share)
    part = "most" if largest.share > MOST_OF_THAT * by_dof[dof] else "the largest part"
    return f"{percent(by_dof[dof])} of {whole} is in {dof}, {part} of that {PHASES[largest.phase]}{_above(gap, dof)}"


def drifts_elsewhere(gap: Gap) -> bool:
    """Whether the largest drift is in another degree of freedom than the largest missing force; never for drift within
    noise."""
    by_force, by_drift = shares_by_dof(gap.where), shares_by_dof(gap.drifted)
    if not by_force or not by_drift or gap.before <= 1.0 + CHANCE:
        return False
    return max(by_force, key=lambda dof: by_force[dof]) != max(by_drift, key=lambda dof: by_drift[dof])


def where_note(gap: Gap) -> str:
    """A note on drift in another degree of freedom than force; "" if both agree."""
    if not drifts_elsewhere(gap):
        return ""
    by_drift = shares_by_dof(gap.drifted)
    dof = max(by_drift, key=lambda name: by_drift[name])
    return (
        f"By drift it is another: {percent(by_drift[dof])} of what the squared {DRIFT_S:g} s drift is beyond noise, in "
        f"floors, is in {dof}. Shares are of the missing force, over the disturbance there."
    )


def shares_by_dof(where: Sequence[Share]) -> dict[str, float]:
    """The share of each degree of freedom, in their given order."""
    out: dict[str, float] = {}
    for share in where:
        out[share.dof] = out.get(share.dof, 0.0) + share.share
    return out


def _above(gap: Gap, dof: str) -> str:
    """Clause on the speed above which most of a degree of freedom's gap lies; "" if that is rest."""
    slices = sorted(
        (item for item in gap.slices if item.dof == dof and item.by == "speed"), key=lambda one: -one.low
    )
    total = sum(item.share for item in slices)
    summed = 0.0
    for one in slices[:-1]:
        summed += one.share
        if total > 0 and summed >= MOST_OF_IT * total:
            return f", mostly above {fixed(one.low, 2)} m/s" if one.low >= LEAST_SPEED_M_S else ""
    return ""


def verdict_sentence(diagnosis: Diagnosis) -> str:
    """The verdict with the gap's location and shrink, after warnings that invalidate it and before provisos."""
    return " ".join((*diagnosis.first, _verdict(diagnosis), *diagnosis.provisos))


def _verdict(diagnosis: Diagnosis) -> str:
    gap = diagnosis.gap
    if diagnosis.verdict == "no_gap":
        drift = f"the model's {DRIFT_S:g} s drift is {_floors(gap.before)}, where noise alone would give {BY_CHANCE}"
        if gap.before > 1.0 + CHANCE:
            return f"Nothing that lasts: {drift}, but neither a candidate nor any force that returns explains it."
        return f"No gap: {drift}, and no candidate explains any of it."
    likely, possible = sorted_by_likelihood(diagnosis.findings)
    if diagnosis.verdict == "unknown" and diagnosis.character is None and swallowing(gap.disturbance):
        return swallowed_sentence(gap.disturbance)
    if diagnosis.verdict == "unknown":
        part = f" {capital(_explain(likely, 'part of the gap'))}." if likely else ""
        part += f" {capital(_may_explain(possible, 'part of the gap'))}." if possible else ""
        part = f"{part[:-1]}{contradiction_clause(diagnosis.heldout, diagnosis.check)}." if part else ""
        return f"Something is there that no candidate explains: {_unexplained(diagnosis, 'it')}.{part}"
    doubt = "".join(
        f", but this dive can't tell {_ambiguity_clause(cause)}" for cause in likely if cause.also
    )
    partly = diagnosis.verdict == "partly"
    no_gap = not partly and _opens_no_gap(diagnosis)
    if not likely:
        causes = _may_explain(possible, "what shows" if no_gap else "the gap")
    else:
        many = len(likely) > 1
        shows = "show, but open no gap" if many else "shows, but opens no gap"
        causes = (
            f"{_all(likely)} {shows}"
            if no_gap
            else _explain(likely, "part of the gap" if partly else "the gap")
        )
        causes += doubt
        if possible:
            causes += f"; {_may_explain(possible, 'some of what shows' if no_gap else 'some of it, too')}"
    causes += contradiction_clause(diagnosis.heldout, diagnosis.check)
    shrink = _drift_clause(diagnosis, "them" if len(diagnosis.findings) > 1 else "it", no_gap)
    where = where_sentence(gap, "what shows") if no_gap else gap_sentence(gap)
    return f"{capital(causes)}: {where}{shrink}.{_rest(diagnosis) if partly else ''}"


def _rest(diagnosis: Diagnosis) -> str:
    """Sentence on the part of the gap that the accepted causes leave."""
    left = diagnosis.gap.unexplained
    share = f", {percent_sure(left)} of what can be closed on pieces held out" if math.isfinite(left) else ""
    return f" Something is left that no candidate explains{share}: {_unexplained(diagnosis, 'that')}."


def _unexplained(diagnosis: Diagnosis, whole: str) -> str:
    """Location and character of the unexplained remainder."""
    gap = diagnosis.gap
    character = f"; {_character_clause(diagnosis.character)}" if diagnosis.character else ""
    of_it = replace(gap, where=gap.unexplained_where, slices=()) if gap.unexplained_where else gap
    return f"{where_sentence(of_it, whole)}{character}"


def sorted_by_likelihood(findings: Sequence[Finding]) -> tuple[tuple[Finding, ...], tuple[Finding, ...]]:
    """Likely causes, and possible ones."""
    likely = tuple(cause for cause in findings if cause.probability >= LIKELY)
    return likely, tuple(cause for cause in findings if cause.probability < LIKELY)


def _explain(findings: Sequence[Finding], what: str) -> str:
    return f"{_all(findings)} {'explain' if len(findings) > 1 else 'explains'} {what}"


def _may_explain(findings: Sequence[Finding], what: str) -> str:
    """Clause on possible causes: `thrust bias or DVL bias (42 % probable) may explain some of it, too`."""
    named = listed([f"{name_of(cause)} ({percent_sure(cause.probability)} probable)" for cause in findings])
    return f"{named} may explain {what}"


def shrink_lines(diagnosis: Diagnosis) -> tuple[str, ...]:
    """Drift over the whole dive, and shrink on held-out pieces and on the check dive.

    With causes, each degree of freedom has a line, before the pooled line.
    """
    fitted = _whole_dive(diagnosis)
    whole = (f"Over the whole dive, which was fitted: {fitted}.",) if fitted else ()
    shrinks = (("On pieces held out", diagnosis.heldout), ("On the check dive", diagnosis.check))
    return (*whole, *(line for where, one in shrinks if one is not None for line in _shrunk(where, one)))


def _shrunk(where: str, shrink: Shrink) -> tuple[str, ...]:
    pooled = ", all together" if shrink.by_axis else ""
    return (*axis_lines(where, shrink), f"{where}{pooled}: {_shrink(shrink)}.")


def character_lines(diagnosis: Diagnosis) -> tuple[str, ...]:
    """A line on the character of the unexplained remainder, if any."""
    one = diagnosis.character
    if one is None:
        return ()
    goes = f"It goes with {listed([variable(v) for v in one.depends_on])}." if one.depends_on else ""
    sentences = (
        "What no candidate explains:",
        f"It acts in {listed(one.dof)}." if one.dof else "",
        f"It is {FRAMES[one.frame]}.",
        f"It is {PARITIES[one.parity]}.",
        f"In time it is {one.timing}.",
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
    return f"it is {FRAMES[character.frame]}, {PARITIES[character.parity].split(':')[0]}, {character.timing}{goes}"


def _shrink(shrink: Shrink) -> str:
    falls = f"the {DRIFT_S:g} s drift goes from {_floors(shrink.before)} to {_floors(shrink.after)}"
    if not math.isfinite(shrink.value):
        return f"{falls}; {NO_SHRINK}"
    interval = percents(shrink.low95, shrink.high95)
    interval_words = f" (95 %: {interval})" if interval else ""
    return f"{falls}, {percent(shrink.value)}{interval_words} of what can be closed"


def _whole_dive(diagnosis: Diagnosis) -> str:
    """Clause on the drift of the gap over the whole dive, before and after; "" without causes."""
    after = [drift.total for drift in diagnosis.gap.after if drift.horizon_s == DRIFT_S]
    if not after or not diagnosis.findings:
        return ""
    return f"the {DRIFT_S:g} s drift goes from {_floors(diagnosis.gap.before)} to {_floors(after[0])}"


def _drifts(diagnosis: Diagnosis) -> tuple[Shrink, str] | None:
    """Drift before and after, and its source by best evidence: check dive, held-out pieces, the dive itself."""
    if diagnosis.check is not None:
        return diagnosis.check, " on the check dive"
    if diagnosis.heldout is not None:
        return diagnosis.heldout, " on pieces held out"
    before = diagnosis.gap.before
    at = [drift.total for drift in diagnosis.gap.after if drift.horizon_s == DRIFT_S]
    closed = before - at[0] if at and before - 1.0 > LEAST_GAP else math.nan
    return (Shrink(before, at[0], closed / (before - 1.0), math.nan, math.nan), "") if at else None


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
    (before, after), where = (drifts[0].before, drifts[0].after), drifts[1]
    numbers = significant(before, 2), significant(after, 2)
    if all(cause.cause.effect.place == "log" for cause in diagnosis.findings):
        return (
            f"; it shows in what is recorded, not in the motion: with {causes} or without, the model's {DRIFT_S:g} s "
            f"drift is {_floors(after)}{where}{_within_noise(before)}"
        )
    if numbers[0] == numbers[1]:
        drift = f"{_floors(after)}{where}{_within_noise(before)}"
        return f"; with {causes} or without, the model's {DRIFT_S:g} s drift is {drift}"
    if no_gap:
        drift = f"{numbers[0]} floors, with {causes} {_floors(after)}{where}{_within_noise(before)}"
        return f"; without {causes} the model's {DRIFT_S:g} s drift is {drift}"
    goes = "falls" if after < before else "goes"
    change = f"from {numbers[0]} to {_floors(after)}"
    if by_axis := changes(drifts[0]):
        pooled = f" (all together {change})"
        return (
            f"; with {causes} the model's {DRIFT_S:g} s drift {by_axis}{pooled}{where}{_within_noise(before)}"
        )
    return f"; with {causes} the model's {DRIFT_S:g} s drift {goes} {change}{where}{_within_noise(before)}"


def _within_noise(before: float) -> str:
    """Clause on drift within noise."""
    return f", where noise alone would give {BY_CHANCE}" if before <= 1.0 + CHANCE else ""


def _all(findings: Sequence[Finding]) -> str:
    return listed([name_of(cause) for cause in findings])


def _ambiguity_clause(finding: Finding) -> str:
    return f"{effect_words(finding.cause.effect)} from {' or '.join(map(words, finding.also))}"


def _floors(value: float) -> str:
    return f"{significant(value, 2)} floors"
