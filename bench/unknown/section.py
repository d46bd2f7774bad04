"""The section of docs/benchmarks.md: forces drawn from a grammar, and whether they are called unknown."""

from collections.abc import Callable, Sequence
from functools import partial
from itertools import pairwise
from operator import attrgetter
from pathlib import Path

from bench.diagnosis.goals import figure_words
from bench.remembered import Remembered
from bench.stamp import CURVES, reached, stamp
from bench.unknown.planted import LEAST_LEFT, MOST_LIKE, MULTIPLES
from bench.unknown.trials import KNOWN as KNOWN_EFFECTS
from bench.unknown.trials import Judged, judged, known_job, unknown_job
from bench.words import blocks, counted, in_a_word, paragraph, table
from identify.challenge.score import Rate

ANSWERS = (reached("bench/unknown/trials.py"), CURVES)
SOURCES = (*ANSWERS, reached("bench/unknown/section.py"))
"""Code that the figures depend on (`bench.stamp`)."""

DRAWN, KNOWN, COUNT = 550_000, 551_000, 300
SHORT_DRAWN, SHORT_KNOWN, SHORT_COUNT = 391_500, 392_000, 24
"""First seeds of drawn forces and of known effects, and the number of each: fixed after the code, so that nothing was
tuned on the draws. The short form, which anyone may look at, uses seeds of development."""


def section(cache: Path, short: bool) -> str:
    first, other, count = (SHORT_DRAWN, SHORT_KNOWN, SHORT_COUNT) if short else (DRAWN, KNOWN, COUNT)
    kept, code = Remembered(cache / "unknown.jsonl"), stamp(*ANSWERS)
    drawn_jobs = {f"drawn {first + i}:{code}": partial(unknown_job, first + i) for i in range(count)}
    known_jobs = {
        f"known {other + i}:{code}": partial(known_job, other + i, KNOWN_EFFECTS[i % len(KNOWN_EFFECTS)])
        for i in range(count)
    }
    drawn = [judged(data) for data in kept.fill(drawn_jobs, "drawn forces").values()]
    known = [judged(data) for data in kept.fill(known_jobs, "known effects").values()]
    return page(drawn, known)


def page(drawn: Sequence[Judged], known: Sequence[Judged]) -> str:
    return blocks(
        "## Unknown forces, drawn by a grammar",
        _introduction(drawn, known),
        goals(drawn, known),
        "By part of the grammar:",
        by_part(drawn),
        misnamed(drawn),
        mistaken(known),
    )


def _introduction(drawn: Sequence[Judged], known: Sequence[Judged]) -> str:
    low, high = MULTIPLES
    return paragraph(
        f"{len(drawn)} dives (seeds from {min(dive.seed for dive in drawn)} on) with one force each that",
        "nobody chose (`bench/unknown/grammar.py`): in one degree of freedom or two, with a velocity, an acceleration,",
        "a thrust, a pulse, an attitude, depth, a product of two of these, or time alone; odd or even; with a lag, a",
        "delay, a leaky integral, hysteresis or none; steady, from a time on, for a while, in bursts or slowly",
        f"drifting; with a period or none. Each causes {low:g} to {high:g} times the noise floor's drift over 5 s,",
        "beyond what a refit of masses, dampings and the trims in roll and pitch takes up. What a refit leaves less",
        f"than {100 * LEAST_LEFT:.0f} % of, or of what one",
        f"known effect holds more than {100 * MOST_LIKE:.0f} %, is drawn again: it is that. {len(known)} dives (seeds",
        f"from {min(dive.seed for dive in known)} on) have one effect of the library each, planted in another form. A",
        "drawn force counts as called unknown by that verdict, or by `partly` where what is left is told in a degree",
        "of freedom of the force.",
    )


LEAST_CALLED, MOST_MISTAKEN = 0.85, 0.02
"""Goals: least share of drawn forces called unknown, largest share of known effects called unknown."""

DRIFTS = (1.5, 2.5, 4.0, 6.6)
"""Ends of the ranges of drift, in floors; a force is scaled to within a tenth of its drawn drift."""


def goals(drawn: Sequence[Judged], known: Sequence[Judged]) -> str:
    called, wrong = _rate(drawn, attrgetter("called")), _rate(known, lambda dive: dive.verdict == "unknown")
    by_name = [dive for dive in drawn if dive.verdict == "unknown"]
    judged_by = (
        ("unknown called so: 85 %", called, called.share >= LEAST_CALLED),
        ("known called unknown: 2 %", wrong, wrong.share <= MOST_MISTAKEN),
    )
    others = {
        "unknown told by a known cause alone": _rate(drawn, _called_by_a_cause),
        "unknown called no gap": _rate(drawn, lambda dive: dive.verdict == "no_gap"),
        "unknown refused": _rate(drawn, lambda dive: dive.verdict == "refused"),
        "unknown with a likely cause, in any verdict": _rate(drawn, lambda dive: bool(dive.causes)),
        "of those with the verdict unknown, right degree of freedom": _rate(
            by_name, lambda dive: dive.right_axis
        ),
        "known called partly": _rate(known, lambda dive: dive.verdict == "partly"),
    }
    return blocks(
        table(
            ("goal", "figure (95 % bounds)", ""),
            [(words, figure_words(rate), in_a_word(met)) for words, rate, met in judged_by],
        ),
        "Beside them:",
        table(("what", "figure"), [(words, figure_words(rate)) for words, rate in others.items()]),
    )


def by_part(drawn: Sequence[Judged]) -> str:
    rows = []
    for part in dict.fromkeys(part for dive in drawn for part in dive.parts):
        for word in sorted({dive.parts[part] for dive in drawn}):
            rows.append(_row(part, word, [dive for dive in drawn if dive.parts[part] == word]))
    for dof in dict.fromkeys(dof for dive in drawn for dof in dive.dofs):
        rows.append(_row("degree of freedom", dof, [dive for dive in drawn if dof in dive.dofs]))
    for hull in sorted({dive.hull for dive in drawn}):
        rows.append(_row("hull", hull, [dive for dive in drawn if dive.hull == hull]))
    for low, high in pairwise(DRIFTS):
        in_range = [dive for dive in drawn if low <= max(dive.multiple, DRIFTS[0]) < high]
        if in_range:
            rows.append(_row("drift", f"{low:g} to {min(high, 6.0):g} floors", in_range))
    return table(("part", "", "dives", "called unknown", "by a known cause", "no gap"), rows)


def misnamed(drawn: Sequence[Judged]) -> str:
    said = (f"`{name}`" for dive in drawn if _called_by_a_cause(dive) for name in dive.causes)
    return paragraph(f"Known causes told instead of an unknown one: {counted(said, nothing='none')}.")


def mistaken(known: Sequence[Judged]) -> str:
    hidden = (f"`{dive.hidden}`" for dive in known if dive.verdict == "unknown")
    return paragraph(f"Known effects called unknown: {counted(hidden, nothing='none')}.")


def _row(part: str, word: str, dives: Sequence[Judged]) -> tuple[object, ...]:
    no_gap = sum(dive.verdict == "no_gap" for dive in dives)
    called, by_cause = (_rate(dives, counts) for counts in (attrgetter("called"), _called_by_a_cause))
    return part, word, len(dives), f"{100 * called.share:.0f} %", by_cause.hits, no_gap


def _called_by_a_cause(dive: Judged) -> bool:
    return not dive.called and dive.verdict in ("explained", "ambiguous", "partly")


def _rate(dives: Sequence[Judged], counts: Callable[[Judged], bool]) -> Rate:
    return Rate(sum(counts(dive) for dive in dives), len(dives))
