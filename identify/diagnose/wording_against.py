"""Sentences on the changes to a simulator."""

from collections.abc import Sequence

from identify.diagnose import wording, wording_verdict
from identify.diagnose.against import Against, Difference
from identify.diagnose.probability import LIKELY
from identify.diagnose.result import Found
from identify.report.text import significant

NAMED = 3
"""Number of numbers named in the verdict, those with the largest error."""


def verdict_sentence(one: Against) -> str:
    """Effects to add, numbers to change, and the drift that they cost, with provisos."""
    provisos = (*one.simulator.first, *one.simulator.provisos)
    of_simulator = (f"Of the simulator: {proviso}" for proviso in provisos)
    return " ".join((*one.vehicle.first, _verdict(one), *one.vehicle.provisos, *of_simulator))


def _verdict(one: Against) -> str:
    gap = one.vehicle.gap
    numbers = _number_words(one.off)
    lacks, possible = wording_verdict.sorted_by_likelihood(one.lacks)
    may_lack = wording.listed([_with_probability(found) for found in possible])
    where = wording_verdict.gap_sentence(gap, "the gap")
    if lacks:
        causes = wording.listed([wording.name_of(found) for found in lacks])
        sentence = f"Your simulator must gain {causes}: {where}{_drift_clause(one)}."
        sentence += f" {_capital(numbers)}." if numbers else ""
        sentence += f" It may lack {may_lack}, too." if possible else ""
    elif numbers:
        shows = "surely shows" if possible else "shows"
        sentence = (
            f"Your simulator lacks no effect that this dive {shows}, but {numbers}{_drift_clause(one)}."
        )
        sentence += f" It may lack {may_lack}, too." if possible else ""
    elif possible:
        sentence = f"Your simulator may lack {may_lack}: {where}{_drift_clause(one)}."
    elif one.vehicle.verdict in ("partly", "unknown"):
        location = wording_verdict.where_sentence(gap, "the gap")
        return f"Your simulator lacks something that no candidate explains: {location}."
    elif one.verdict == "no_gap":
        sentence = (
            f"Your simulator lacks nothing that this dive shows: its {wording.DRIFT_S:g} s drift is "
            f"{significant(gap.before, 2)} floors, where noise alone would give 1."
        )
    else:
        sentence = (
            "Your simulator lacks no effect that this dive shows, and of its numbers none is off beyond doubt, but its "
            f"{wording.DRIFT_S:g} s drift is {significant(gap.before, 2)} floors, where noise alone would give 1"
            f"{_drift_clause(one)}: give longer recordings of both, with the same manoeuvres."
        )
    if one.vehicle.verdict in ("partly", "unknown"):
        sentence += " Something else is there that no candidate explains."
    return sentence


def cause_lines(one: Against) -> tuple[str, ...]:
    """The causes of the real dive, each marked if the simulator has it."""
    has = {found.cause.key: found.probability for found in one.has}
    pairs = zip(one.vehicle.found, wording.cause_lines(one.vehicle), strict=True)
    return tuple(_already(has.get(found.cause.key)) + line for found, line in pairs)


def _already(probability: float | None) -> str:
    """Prefix for a cause that the simulator has, or may have; "" for a missing cause."""
    if probability is None:
        return ""
    if probability < LIKELY:
        return f"Your simulator may have it already ({wording.percent_sure(probability)} probable): "
    return "Your simulator has it already: "


def lines(one: Against) -> tuple[str, ...]:
    """All further remarks: numbers to change, effects that the dive does not show, undetermined axes."""
    untold = (
        [
            f"In {wording.listed(one.untold)} nothing is said of masses and dampings: one of the recordings "
            "hardly tells them."
        ]
        if one.untold
        else []
    )
    numbers = [f"{_capital(difference_sentence(each))}." for each in one.differences]
    return (*numbers, *map(_story_sentence, one.stories), *map(_spare_sentence, one.spare), *untold)


def _story_sentence(found: Found) -> str:
    clause = (
        f"{wording.name_of(found)} would make"
        if found.probability >= LIKELY
        else f"{_with_probability(found)} may make"
    )
    values = ", ".join(
        wording.value_words(name, value) for name, value in wording.told_parameters(found).items()
    )
    return f"{_capital(clause)} masses and dampings differ so: {found.cause.effect.sentence} ({values})."


def _spare_sentence(found: Found) -> str:
    shows = (
        f"shows {wording.name_of(found)}"
        if found.probability >= LIKELY
        else f"may show {_with_probability(found)}"
    )
    return f"Its own recording {shows}, which this dive does not: look whether it should be there."


def _with_probability(found: Found) -> str:
    return f"{wording.name_of(found)} ({wording.percent_sure(found.probability)} probable)"


def difference_sentence(one: Difference) -> str:
    """`its M_u is 12 % too small: 105 kg, the vehicle's is 119 kg`."""
    unit = wording.unit_after(one.vehicle.unit)
    return (
        f"{_error_words(one)}: {significant(one.simulator.value)}{unit}, the vehicle's is "
        f"{significant(one.vehicle.value)}{unit}"
    )


def _error_words(one: Difference) -> str:
    whose = f"its {wording.words(one.of)}'s {wording.parameter(one.name)}" if one.of else f"its {one.name}"
    off = f"{wording.percent(abs(one.share))} too {'large' if one.share > 0 else 'small'}"
    if one.probability >= LIKELY:
        return f"{whose} is {off}"
    return (
        f"{whose} may be {off} ({wording.words(one.of)} is {wording.percent_sure(one.probability)} probable)"
    )


def _number_words(differences: Sequence[Difference]) -> str:
    order = sorted(differences, key=lambda each: -abs(each.share))
    named = [_error_words(each) for each in order[:NAMED]]
    more = len(order) - NAMED
    return wording.listed([*named, f"{more} more of its numbers are off"] if more > 0 else named)


def _drift_clause(one: Against) -> str:
    after = [drift.total for drift in one.vehicle.gap.after if drift.horizon_s == wording.DRIFT_S]
    if not after:
        return ""
    return (
        f"; with the vehicle's numbers its {wording.DRIFT_S:g} s drift goes from "
        f"{significant(one.vehicle.gap.before, 2)} to {significant(after[0], 2)} floors"
    )


def _capital(text: str) -> str:
    return f"{text[:1].upper()}{text[1:]}"
