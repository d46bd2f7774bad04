"""A diagnosis in sentences, for the command, the app and the reports: verdict, gap, causes, shrink, next dive."""

import math
from collections.abc import Sequence
from dataclasses import replace

from bridge.vehicle.coefficients import DOFS
from identify.diagnose.drift import Drift
from identify.diagnose.gap import LEAST_SPEED_M_S
from identify.diagnose.result import (
    Character,
    Diagnosis,
    Disturbance,
    Finding,
    Gap,
    Next,
    Phase,
    Share,
    Value,
)
from identify.diagnose.shrink import CHANCE, closed, contradiction_clause, shown
from identify.diagnose.shrunk import LIKELY, AxisShrink, Shrink
from identify.diagnose.verdict import MOST_DISTURBED, swallowing
from identify.effects.effect import Effect
from identify.words import capital, fixed, listed, significant, unit_after, with_interval

DRIFT_S = 5.0
"""Horizon of the drift in sentences."""

CAPITALS = {"dvl": "DVL", "imu": "IMU", "cg": "CG"}

SINCE = "since it was accepted"
"""Variant of an effect that is the change of an accepted effect."""


def cause_lines(diagnosis: Diagnosis) -> tuple[str, ...]:
    """A line per cause: name, probability, description, parameters and ambiguity."""
    return tuple(_cause_line(finding) for finding in diagnosis.findings)


def next_lines(diagnosis: Diagnosis) -> tuple[str, ...]:
    """The next dive or sensor; empty without ambiguity."""
    return () if diagnosis.next is None else _next(diagnosis.next)


def name_of(finding: Finding) -> str:
    """The cause and its ambiguity group: `thruster lag or command delay`."""
    return " or ".join((effect_words(finding.cause.effect), *map(words, finding.also)))


def effect_words(effect: Effect) -> str:
    """An effect's name in words, with its thruster's number if it has one."""
    name = _of_thruster(effect.name, effect.number) if effect.number else words(effect.name)
    return f"a change of {name}" if effect.variant == SINCE else name


def words(name: str) -> str:
    """The name of an effect in words: `dvl_bias` is a DVL bias."""
    return " ".join(CAPITALS.get(part, part) for part in name.split("_"))


def candidate_words(effect: Effect) -> str:
    """Its name in words, with its thruster's number and its variant if it has them."""
    name = _of_thruster(effect.name, effect.number) if effect.number else words(effect.name)
    return f"{name} ({effect.variant})" if effect.variant else name


def _of_thruster(name: str, number: int) -> str:
    """`weak thruster 8`, `thruster misalignment (thruster 8)`."""
    wording = words(name)
    return f"{wording} {number}" if wording.endswith("thruster") else f"{wording} (thruster {number})"


def percents(low: float, high: float) -> str:
    """An interval of shares in per cent; "" if unknown or too narrow to show."""
    ends = percent(low), percent(high)
    return f"{ends[0]} to {ends[1]}" if math.isfinite(high - low) and ends[0] != ends[1] else ""


def value_words(name: str, value: Value) -> str:
    """`X_uu 12.3 N s²/m² (95 %: 10.1 to 14.5)`; with degrees for angles, and rates per minute."""
    number, interval = with_interval(value.value, value.low95, value.high95)
    known = math.isfinite(value.low95) and math.isfinite(value.high95)
    interval_words = f" (95 %: {interval})" if known and value.high95 > value.low95 else ""
    return f"{parameter(name)} {number}{unit_after(value.unit)}{interval_words}{_in_other_units(value)}"


def parameter(name: str) -> str:
    """A parameter's name in words: without underscores; symbols unchanged."""
    return name.replace("_", " ") if name.islower() else name


def shown_parameters(finding: Finding) -> dict[str, Value]:
    """A cause's parameters without the thruster's number, which is in its name."""
    return {name: value for name, value in finding.parameters.items() if name != "thruster"}


def cause_sentence(finding: Finding) -> str:
    """A cause, its probability and description."""
    effect = finding.cause.effect
    return f"{capital(effect_words(effect))}, {percent_bounded(finding.probability)} probable: {effect.sentence}."


def alike_sentence(finding: Finding) -> str:
    """A cause's ambiguity group, and how to resolve it."""
    alike = " or ".join(
        f"{words(name)} (likeness {fixed(finding.likeness[name], 2)})"
        if name in finding.likeness
        else words(name)
        for name in finding.also
    )
    return f"This dive can't tell it from {alike}; what would: {'; '.join(finding.cause.effect.separation.every)}."


def percent(share: float) -> str:
    return f"{fixed(100 * share, 0)} %"


def mm_s(value_m_s: float) -> str:
    return f"{significant(1000 * value_m_s, 2)} mm/s"


def _cause_line(finding: Finding) -> str:
    values = [value_words(name, value) for name, value in shown_parameters(finding).items()]
    parameters = f" Fitted: {', '.join(values)}." if values else ""
    doubt = f" {alike_sentence(finding)}" if finding.also else ""
    return f"{cause_sentence(finding)}{parameters}{doubt}"


def percent_bounded(probability: float) -> str:
    """A probability in per cent, never 0 or 100."""
    if probability >= 0.995:
        return "over 99 %"
    return "under 1 %" if probability < 0.005 else percent(probability)


def _next(advice: Next) -> tuple[str, ...]:
    splits = f" It splits {listed([words(name) for name in advice.splits])}." if advice.splits else ""
    dive = f"Dive next: {'; '.join(advice.manoeuvres)}.{splits}" if advice.manoeuvres else ""
    sensor = f"Record as well: {'; '.join(advice.sensors)}." if advice.sensors else ""
    return tuple(line for line in (dive, sensor) if line)


def _in_other_units(value: Value) -> str:
    if value.unit == "rad":
        return f", {significant(math.degrees(value.value), 2)}°"
    if value.unit == "1/s":
        return f", {significant(6000 * value.value, 2)} % a minute"
    return ""


NAMED = 2
"""Number of degrees of freedom named in the verdict."""

BARELY = 0.1
"""Share of the largest change of a drift, both in floors, below which a change is not named."""

TURNING = DOFS[3:]

MAY_BE = "a sea or a current that comes and goes, a tether, or thrust that the vehicle file or the recording has wrong"


def rate(value: float, dof: str) -> str:
    """A velocity in mm/s, or a rate of turn in deg/s, from m/s or rad/s."""
    scaled = math.degrees(value) if dof in TURNING else 1e3 * value
    return f"{significant(scaled, 2)} {'deg/s' if dof in TURNING else 'mm/s'}"


def closes(share: float) -> str:
    """`closes 86 %`: the share of a drift beyond noise that goes with the causes."""
    return f"closes {percent(share)}"


def _axis_words(axis: AxisShrink) -> str:
    gone = f"; {closes(axis.value)} of what is beyond noise" if math.isfinite(axis.value) else ""
    return (
        f"the {DRIFT_S:g} s drift goes from {rate(axis.before, axis.dof)} to {rate(axis.after, axis.dof)} "
        f"(noise alone {rate(axis.floor, axis.dof)}){gone}"
    )


def of_dive(gap: Gap) -> tuple[AxisShrink, ...]:
    """The drift of the whole dive by fitted degree of freedom, with the causes and without; both alike where the causes
    were not simulated."""
    before = _at_horizon(gap.drifts)
    if before is None or not len(before.off):
        return ()
    after = _at_horizon(gap.after) or before
    return tuple(
        AxisShrink(
            DOFS[dof],
            float(before.rms[dof]),
            float(after.rms[dof]),
            float(before.floor[dof]),
            closed(float(before.by_axis[dof]), float(after.by_axis[dof])),
            *(math.nan,) * 3,
        )
        for dof in range(len(DOFS))
        if math.isfinite(before.floor[dof])
    )


def _at_horizon(drifts: Sequence[Drift]) -> Drift | None:
    return next((drift for drift in drifts if drift.horizon_s == DRIFT_S), None)


def level(axes: Sequence[AxisShrink], *, before: bool = True) -> str:
    """`16 mm/s in surge (noise alone 9.0 mm/s)`, before the causes or with them, of the degrees of freedom that drift
    furthest in floors."""
    drifts = [(axis, axis.before if before else axis.after) for axis in axes]
    drifts.sort(key=lambda item: -item[1] / item[0].floor)
    named = (
        f"{rate(drift, axis.dof)} in {axis.dof} (noise alone {rate(axis.floor, axis.dof)})"
        for axis, drift in drifts[:NAMED]
    )
    return listed(list(named)) or "unknown"


def changes(axes: Sequence[AxisShrink]) -> str:
    """`falls from 34 to 16 mm/s in surge and from 2.1 to 1.2 deg/s in yaw`: the translation and the rotation that
    change most, or two of a kind where the other does not change by much in floors; "" if none changes."""
    moved = [axis for axis in axes if math.isfinite(axis.value) and axis.before != axis.after]
    if not moved:
        return ""
    least = BARELY * max(_in_floors(axis) for axis in moved)
    moved = sorted((axis for axis in moved if _in_floors(axis) >= least), key=_change, reverse=True)
    of_each_kind = {axis.dof in TURNING: axis for axis in reversed(moved)}
    named = list(of_each_kind.values()) if len(of_each_kind) == NAMED else moved[:NAMED]
    named.sort(key=lambda axis: (-_in_floors(axis), axis.dof in TURNING))
    goes = "falls" if all(axis.after < axis.before for axis in named) else "goes"
    phrases = [
        f"from {rate(item.before, item.dof)} to {rate(item.after, item.dof)} in {item.dof}" for item in named
    ]
    return f"{goes} {listed(phrases)}"


def _change(axis: AxisShrink) -> float:
    return abs(axis.before - axis.after)


def _in_floors(axis: AxisShrink) -> float:
    return _change(axis) / axis.floor


def disturbance_words(disturbance: Disturbance) -> str:
    """`3.1 N, 62 % of the variance of the thrusters' force`."""
    whole = "the thrusters' force" if disturbance.pushed else "the force that the motion takes"
    return f"{force_words(disturbance)}, {percent_bounded(disturbance.share)} of the variance of {whole}"


def force_words(disturbance: Disturbance) -> str:
    """Its standard deviation with the unit."""
    return f"{significant(disturbance.std, 2)} {'N m' if disturbance.dof in TURNING else 'N'}"


def disturbance_line(disturbance: Sequence[Disturbance]) -> tuple[str, ...]:
    """A line on the fitted disturbance in each pushed degree of freedom."""
    pushed = [axis for axis in disturbance if axis.pushed]
    if not pushed:
        return ()
    phrases = listed([f"in {axis.dof} {force_words(axis)} ({_share_words(axis)})" for axis in pushed])
    line = f"The fitted disturbance takes {phrases}; in brackets the share of the variance of the thrusters' force."
    if swallowing(pushed):
        line += f" More than a third is much: {MAY_BE}."
    return (line,)


def _share_words(disturbance: Disturbance) -> str:
    """Share of the variance; marked in a degree of freedom that is only held, where thrust merely answers the
    disturbance."""
    held = not disturbance.driven and disturbance.share > MOST_DISTURBED
    return f"{percent_bounded(disturbance.share)}, only held" if held else percent_bounded(disturbance.share)


def swallowed_sentence(disturbance: Sequence[Disturbance]) -> str:
    """Sentence that a disturbance takes so much that its model explains too little."""
    text = listed([f"in {axis.dof} it takes {disturbance_words(axis)}" for axis in swallowing(disturbance)])
    return (
        f"No candidate and no force that returns is missing, but the model leaves too much to the disturbance: {text}. "
        f"It may be {MAY_BE}; the model explains too little there to say that there is no gap."
    )


MOST_OF_IT = 0.75
"""Share of a degree of freedom's gap above a speed, for `mostly above`."""

MOST_OF_THAT = 0.5
"""Share of a degree of freedom's gap in one phase, for `most of that`."""

ALL = 0.95
"""Share of the gap from which it is all of it."""

LEAST_NAMED = 0.02
"""Share of the gap below which a part of it is not named."""

LITTLE = 0.1
"""Share of a missing force's power below which it hardly goes with a variable."""

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

NO_MORE = "no more than noise makes it by chance"

NO_SHRINK = "there is too little drift beyond noise to close"

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


def where_line(diagnosis: Diagnosis, most: int = 3) -> str:
    """Where the largest parts of the missing force lie, `surge, steady; yaw, turning`, at most `most`."""
    largest = sorted(diagnosis.gap.where, key=lambda each: -each.share)[:most]
    return "; ".join(f"{item.dof}, {PHASES[item.phase]}" for item in largest if item.share >= LEAST_NAMED)


def gap_sentence(gap: Gap, whole: str = "it") -> str:
    """Location of the gap, and the degree of freedom that drifts furthest if it is another one."""
    elsewhere = drifts_elsewhere(gap)
    return where_sentence(gap, whole) + (f", while most of the drift is in {elsewhere}" if elsewhere else "")


def where_sentence(gap: Gap, whole: str = "it") -> str:
    """`most of it lies in surge, steady, mostly above 0.3 m/s`; `whole` names the total."""
    if not gap.where:
        return "no degree of freedom was compared"
    first = max(gap.where, key=lambda each: each.share)
    if first.share >= STANDS_OUT:
        lies = f"{_most(first.share)} of {whole} lies in {first.dof}"
        return f"{lies}, {PHASES[first.phase]}{_above(gap, first.dof)}"
    by_dof = shares_by_dof(gap.where)
    dof = max(by_dof, key=lambda name: by_dof[name])
    of_dof = [item for item in gap.where if item.dof == dof]
    largest = max(of_dof, key=lambda each: each.share)
    part = "most" if largest.share > MOST_OF_THAT * by_dof[dof] else "the largest part"
    lies = f"{_most(by_dof[dof])} of {whole} lies in {dof}"
    return f"{lies}, {part} of that {PHASES[largest.phase]}{_above(gap, dof)}"


def _most(share: float) -> str:
    return "all" if share >= ALL else "most" if share > MOST_OF_THAT else "the largest part"


def drifts_elsewhere(gap: Gap) -> str:
    """The degree of freedom that drifts furthest if it is another than that of the largest missing force, else "";
    never for drift within noise."""
    by_force, by_drift = shares_by_dof(gap.where), shares_by_dof(gap.drifted)
    if not by_force or not by_drift or gap.before <= 1.0 + CHANCE:
        return ""
    furthest = max(by_drift, key=lambda dof: by_drift[dof])
    return "" if furthest == max(by_force, key=lambda dof: by_force[dof]) else furthest


def strength(share: float) -> str:
    """How closely a missing force goes with a variable, by the share of its power that does."""
    return "closely" if share >= STANDS_OUT else "in part" if share >= LITTLE else "hardly"


def shares_by_dof(where: Sequence[Share]) -> dict[str, float]:
    """The share of each degree of freedom, in their given order."""
    out: dict[str, float] = {}
    for share in where:
        out[share.dof] = out.get(share.dof, 0.0) + share.share
    return out


def _above(gap: Gap, dof: str) -> str:
    """Clause on the speed above which most of a degree of freedom's gap lies; "" if that is rest."""
    slices = sorted(
        (item for item in gap.slices if item.dof == dof and item.by == "speed"), key=lambda each: -each.low
    )
    total = sum(item.share for item in slices)
    summed = 0.0
    for each in slices[:-1]:
        summed += each.share
        if total > 0 and summed >= MOST_OF_IT * total:
            return f", mostly above {fixed(each.low, 2)} m/s" if each.low >= LEAST_SPEED_M_S else ""
    return ""


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
        part = f"{part[:-1]}{contradiction_clause(diagnosis.heldout, diagnosis.check)}." if part else ""
        return f"Something is there that no candidate explains: {_unexplained(diagnosis, 'it')}.{part}"
    alike = [
        f"{effect_words(cause.cause.effect)} from {' or '.join(map(words, cause.also))}"
        for cause in likely
        if cause.also
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
        f"Beside what was accepted {listed(causes)} {_shows(shown)}: as much as its values are unsure by.",
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
    """Location and character of the unexplained remainder."""
    gap = diagnosis.gap
    character = f"; {_character_clause(diagnosis.character)}" if diagnosis.character else ""
    of_it = replace(gap, where=gap.unexplained_where, slices=()) if gap.unexplained_where else gap
    return f"{where_sentence(of_it, whole)}{character}"


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
        f"{where}, {axis.dof}: {_axis_words(axis)}." for where, each in shrinks[-1:] for axis in each.by_axis
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
        f"It is {PARITIES[character.parity]}.",
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
    return f"it is {FRAMES[character.frame]}, {PARITIES[character.parity].split(':')[0]}, {character.timing}{goes}"


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
    gone = f", which {closes(shrink.value)} of what is beyond noise" if math.isfinite(shrink.value) else ""
    return f"with {causes} {drift} {moved}{where}{'' if no_gap else gone}{within}"


def _all(findings: Sequence[Finding]) -> str:
    return listed([name_of(cause) for cause in findings])
