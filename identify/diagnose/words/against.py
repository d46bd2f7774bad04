"""A dive against a simulator, in words: the verdict, the thrust, the causes, and the numbers to change."""

from collections.abc import Sequence

from identify.diagnose.result import Finding, Value
from identify.diagnose.shrink.shrunk import LIKELY
from identify.diagnose.simulators.comparison import THRUST, Against, Difference
from identify.diagnose.simulators.thrust_ratio import ThrustRatio
from identify.diagnose.words import causes as cause_words
from identify.diagnose.words import diagnosis as wording
from identify.diagnose.words import drift as drift_words
from identify.diagnose.words import gap as gap_words
from identify.words import capital, fixed, listed, significant, unit_after, with_interval

NAMED = 3
"""Number of numbers named in the verdict, those with the largest error."""


def verdict_sentence(comparison: Against) -> str:
    """Effects to add, numbers to change, and the drift that they cost, with provisos."""
    provisos = (*comparison.simulator.first, *comparison.simulator.provisos)
    of_simulator = (f"Of the simulator: {proviso}" for proviso in provisos)
    return " ".join(
        (*comparison.vehicle.first, _verdict(comparison), *comparison.vehicle.provisos, *of_simulator)
    )


def _verdict(comparison: Against) -> str:
    gap = comparison.vehicle.gap
    numbers = listed([*_thrust_words(comparison.thrust), *_number_words(comparison.off)])
    lacks, possible = wording.sorted_by_likelihood(comparison.lacks)
    may_lack = listed([_with_probability(item) for item in possible])
    where = gap_words.gap_sentence(gap, "the gap")
    if lacks:
        causes = listed([cause_words.name_of(lack) for lack in lacks])
        sentence = f"Your simulator must gain {causes}: {where}{_drift_clause(comparison)}."
        sentence += f" {capital(numbers)}." if numbers else ""
        sentence += f" It may lack {may_lack}, too." if possible else ""
    elif numbers:
        shows = "surely shows" if possible else "shows"
        sentence = f"Your simulator lacks no effect that this dive {shows}, but {numbers}{_drift_clause(comparison)}."
        sentence += f" It may lack {may_lack}, too." if possible else ""
    elif possible:
        sentence = f"Your simulator may lack {may_lack}: {where}{_drift_clause(comparison)}."
    elif comparison.vehicle.verdict in ("partly", "unknown"):
        location = gap_words.where_sentence(gap, "the gap")
        return f"Your simulator lacks something that no candidate explains: {location}."
    elif comparison.verdict == "no_gap":
        sentence = (
            f"Your simulator lacks nothing that this dive shows: its {drift_words.DRIFT_S:g} s drift is "
            f"{_level(comparison)}, {wording.NO_MORE}."
        )
    else:
        sentence = (
            "Your simulator lacks no effect that this dive shows, and of its numbers none is off beyond doubt, but its "
            f"{drift_words.DRIFT_S:g} s drift is {_level(comparison)}"
            f"{_drift_clause(comparison)}: give longer recordings of both, with the same manoeuvres."
        )
    if comparison.vehicle.verdict in ("partly", "unknown"):
        sentence += " Something else is there that no candidate explains."
    return sentence


def thrust_sentences(comparison: Against) -> tuple[str, ...]:
    """The ratio of the thrusts, then the delay; nothing where a recording's thrust or velocity is of no known sign."""
    if comparison.vehicle.first or comparison.simulator.first:
        return ()
    return (*_ratio_sentence(comparison.thrust), *_delay_sentence(comparison.thrust))


def _ratio_sentence(thrust: ThrustRatio) -> tuple[str, ...]:
    if thrust.whole is None:
        return ()
    axes = listed([f"{dof} {_with_interval(value)}" for dof, value in thrust.by_axis.items()])
    whole = f"The vehicle's thrust is {_with_interval(thrust.whole)} of the simulator's"
    if not thrust.differs:
        whole = f"The vehicle's thrust is not told from the simulator's: {_with_interval(thrust.whole)} of it"
    return (f"{whole}; by axis: {axes}.",)


def _delay_sentence(thrust: ThrustRatio) -> tuple[str, ...]:
    if thrust.later is None:
        return ("How late the thrust comes, one of the recordings does not tell.",)
    later = thrust.later
    low, high = sorted(abs(end) for end in (later.low95, later.high95))
    if not thrust.is_later:
        return (
            f"It comes no later than the simulator's: {_ms(later.value)} ms (95 %: {_ms(later.low95)} to "
            f"{_ms(later.high95)}).",
        )
    way = "later" if later.value > 0 else "earlier"
    return (
        f"It comes {_ms(abs(later.value))} ms {way} than the simulator's (95 %: {_ms(low)} to {_ms(high)}).",
    )


def _with_interval(ratio: Value) -> str:
    number, interval = with_interval(ratio.value, ratio.low95, ratio.high95)
    return f"{number} (95 %: {interval})"


def _ms(seconds: float) -> str:
    return fixed(1e3 * seconds, 0)


def _thrust_words(thrust: ThrustRatio) -> list[str]:
    """`its thrust is 25 % too strong`; nothing where it is alike."""
    if not thrust.differs or thrust.whole is None:
        return []
    off = 1.0 / thrust.whole.value - 1.0
    return [f"its thrust is {cause_words.percent(abs(off))} too {'strong' if off > 0 else 'weak'}"]


def cause_lines(comparison: Against) -> tuple[str, ...]:
    """The causes of the real dive, each marked if the simulator has it."""
    return tuple(line for _, line in _weighed_causes(comparison))


def difference_lines(comparison: Against) -> tuple[str, ...]:
    """Causes and numbers that differ, by the real dive's evidence, strongest first; causes of both come last."""
    lines_of = [*_weighed_causes(comparison), *_weighed_numbers(comparison)]
    return tuple(line for _, line in sorted(lines_of, key=lambda each: -each[0]))


def _weighed_causes(comparison: Against) -> list[tuple[float, str]]:
    """Nats, 0 for a cause that the simulator has, and line of each cause; not the thrust's, nor a story of no number
    that differs."""
    has = {item.cause.key: item.probability for item in comparison.has}
    stories = {id(item) for item in comparison.stories}
    pairs = zip(comparison.vehicle.findings, wording.cause_lines(comparison.vehicle), strict=True)
    return [
        (
            0.0 if finding.cause.key in has else finding.gain_nats,
            _already(has.get(finding.cause.key)) + line,
        )
        for finding, line in pairs
        if not finding.cause.effect.refit_absorbs
        or (id(finding) in stories and not _is_of_thrust(comparison, finding))
    ]


def _is_of_thrust(comparison: Against, finding: Finding) -> bool:
    return finding.name == THRUST and comparison.thrust.differs


def _weighed_numbers(comparison: Against) -> list[tuple[float, str]]:
    return [(each.nats, f"{capital(difference_sentence(each))}.") for each in comparison.differences]


def _already(probability: float | None) -> str:
    """Prefix for a cause that the simulator has, or may have; "" for a missing cause."""
    if probability is None:
        return ""
    if probability < LIKELY:
        return f"Your simulator may have it already ({cause_words.percent_bounded(probability)} probable): "
    return "Your simulator has it already: "


def lines(comparison: Against) -> tuple[str, ...]:
    """Numbers to change, then all further remarks."""
    return (*(line for _, line in _weighed_numbers(comparison)), *further_lines(comparison))


def further_lines(comparison: Against) -> tuple[str, ...]:
    """Causes that would make numbers differ, effects that the dive does not show, undetermined axes."""
    untold = (
        [
            f"In {listed(comparison.untold)} nothing is said of masses and dampings: one of the recordings "
            "hardly tells them."
        ]
        if comparison.untold
        else []
    )
    stories = [finding for finding in comparison.stories if not _is_of_thrust(comparison, finding)]
    return (*map(_story_sentence, stories), *map(_spare_sentence, comparison.spare), *untold)


def _story_sentence(finding: Finding) -> str:
    clause = (
        f"{cause_words.name_of(finding)} would make"
        if finding.probability >= LIKELY
        else f"{_with_probability(finding)} may make"
    )
    values = ", ".join(
        cause_words.value_words(name, value) for name, value in cause_words.shown_parameters(finding).items()
    )
    return f"{capital(clause)} masses and dampings differ so: {finding.cause.effect.sentence} ({values})."


def _spare_sentence(finding: Finding) -> str:
    shows = (
        f"shows {cause_words.name_of(finding)}"
        if finding.probability >= LIKELY
        else f"may show {_with_probability(finding)}"
    )
    return f"Its own recording {shows}, which this dive does not: look whether it should be there."


def _with_probability(finding: Finding) -> str:
    return f"{cause_words.name_of(finding)} ({cause_words.percent_bounded(finding.probability)} probable)"


def difference_sentence(difference: Difference) -> str:
    """`its M_u is 12 % too small: 105 kg, the vehicle's is 119 kg`."""
    unit = unit_after(difference.vehicle.unit)
    at_one_thrust = " at the simulator's thrust" if difference.thrust != 1.0 else ""
    return (
        f"{_error_words(difference)}: {significant(difference.simulator.value)}{unit}, the vehicle's is "
        f"{significant(difference.vehicle.value)}{unit}{at_one_thrust}"
    )


def _error_words(difference: Difference) -> str:
    whose = (
        f"its {cause_words.words(difference.of)}'s {cause_words.parameter(difference.name)}"
        if difference.of
        else f"its {difference.name}"
    )
    off = f"{cause_words.percent(abs(difference.share))} too {'large' if difference.share > 0 else 'small'}"
    if difference.probability >= LIKELY:
        return f"{whose} is {off}"
    probable = f"{cause_words.words(difference.of)} is {cause_words.percent_bounded(difference.probability)} probable"
    return f"{whose} may be {off} ({probable})"


def _number_words(differences: Sequence[Difference]) -> list[str]:
    order = sorted(differences, key=lambda each: -abs(each.share))
    named = [_error_words(each) for each in order[:NAMED]]
    more = len(order) - NAMED
    return [*named, f"{more} more of its numbers are off"] if more > 0 else named


def _drift_clause(comparison: Against) -> str:
    moved = drift_words.changes(drift_words.of_dive(comparison.vehicle.gap))
    return f"; with the vehicle's numbers its {drift_words.DRIFT_S:g} s drift {moved}" if moved else ""


def _level(comparison: Against) -> str:
    return drift_words.level(drift_words.of_dive(comparison.vehicle.gap))
