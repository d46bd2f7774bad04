"""What a simulator must gain, in sentences."""

from collections.abc import Sequence

from identify.diagnose import words
from identify.diagnose.against import Against, Difference
from identify.report.text import significant

NAMED = 3
"""So many numbers that must change are named in the verdict, those that are off by most."""


def verdict_sentence(one: Against) -> str:
    """Which effects the simulator must gain, which of its numbers must change, and what that makes of its drift; under
    what provisos."""
    its = (f"Of the simulator: {proviso}" for proviso in one.simulator.provisos)
    return " ".join((_verdict(one), *one.vehicle.provisos, *its))


def _verdict(one: Against) -> str:
    gap = one.vehicle.gap
    numbers = _numbers(one.differences)
    if one.lacks:
        causes = words.listed([words.name_of(found) for found in one.lacks])
        also = f" {_capital(numbers)}." if numbers else ""
        told = (
            f"Your simulator must gain {causes}: {words.where_sentence(gap, 'the gap')}{_falls(one)}.{also}"
        )
    elif numbers:
        told = f"Your simulator lacks no effect that this dive shows, but {numbers}{_falls(one)}."
    elif one.vehicle.verdict == "unknown":
        return f"Your simulator lacks something that no candidate explains: {words.where_sentence(gap, 'the gap')}."
    elif one.verdict == "no_gap":
        told = (
            f"Your simulator lacks nothing that this dive shows: its {words.DRIFT_S:g} s drift is "
            f"{significant(gap.before, 2)} floors, where noise alone would give 1."
        )
    else:
        told = (
            "Your simulator lacks no effect that this dive shows, and of its numbers none is off beyond doubt, but its "
            f"{words.DRIFT_S:g} s drift is {significant(gap.before, 2)} floors, where noise alone would give 1"
            f"{_falls(one)}: give longer recordings of both, with the same manoeuvres."
        )
    if one.vehicle.verdict == "unknown":
        told += " Something else is there that no candidate explains."
    return told


def cause_lines(one: Against) -> tuple[str, ...]:
    """What the real dive shows, cause by cause, and which of it the simulator has already."""
    told = zip(one.vehicle.found, words.cause_lines(one.vehicle), strict=True)
    lacks = {id(found) for found in one.lacks}
    return tuple(
        line
        if id(found) in lacks or found.cause.effect.refit_absorbs
        else f"Your simulator has it already: {line}"
        for found, line in told
    )


def lines(one: Against) -> tuple[str, ...]:
    """What else there is to say: each number that must change, effects that the dive does not show, axes untold."""
    spare = [
        f"Its own recording shows {words.name_of(found)}, which this dive does not: look whether it should be there."
        for found in one.spare
    ]
    untold = (
        [
            f"In {words.listed(one.untold)} nothing is said of masses and dampings: one of the recordings hardly tells "
            "them."
        ]
        if one.untold
        else []
    )
    stories = [
        f"{_capital(words.name_of(found))} would make masses and dampings differ so: {found.cause.effect.sentence} "
        f"({', '.join(words.value_words(name, value) for name, value in words.told_parameters(found).items())})."
        for found in one.stories
    ]
    numbers = [f"{_capital(difference_sentence(each))}." for each in one.differences]
    return (*numbers, *stories, *spare, *untold)


def difference_sentence(one: Difference) -> str:
    """`its M_u is 12 % too small: 105 kg, the vehicle's is 119 kg`."""
    unit = words.unit_after(one.vehicle.unit)
    return (
        f"{_off(one)}: {significant(one.simulator.value)}{unit}, the vehicle's is "
        f"{significant(one.vehicle.value)}{unit}"
    )


def _off(one: Difference) -> str:
    whose = f"its {words.words(one.of)}'s {words.parameter(one.name)}" if one.of else f"its {one.name}"
    return f"{whose} is {words.percent(abs(one.share))} too {'large' if one.share > 0 else 'small'}"


def _numbers(differences: Sequence[Difference]) -> str:
    order = sorted(differences, key=lambda each: -abs(each.share))
    named = [_off(each) for each in order[:NAMED]]
    more = len(order) - NAMED
    return words.listed([*named, f"{more} more of its numbers are off"] if more > 0 else named)


def _falls(one: Against) -> str:
    after = [drift.total for drift in one.vehicle.gap.after if drift.horizon_s == words.DRIFT_S]
    if not after:
        return ""
    return (
        f"; with the vehicle's numbers its {words.DRIFT_S:g} s drift goes from "
        f"{significant(one.vehicle.gap.before, 2)} to {significant(after[0], 2)} floors"
    )


def _capital(text: str) -> str:
    return f"{text[:1].upper()}{text[1:]}"
