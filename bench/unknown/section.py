"""The section of docs/benchmarks.md: forces drawn from a grammar, and whether they are called unknown."""

from collections.abc import Sequence
from pathlib import Path

from bench.remembered import Remembered
from bench.stamp import stamp
from bench.unknown import tables
from bench.unknown.planted import LEAST_LEFT, MOST_LIKE, MULTIPLES
from bench.unknown.seeds import COUNT, DRAWN, KNOWN, SHORT_COUNT, SHORT_DRAWN, SHORT_KNOWN
from bench.unknown.sources import ANSWERS
from bench.unknown.trials import Judged, judged, known_jobs, unknown_jobs
from bench.words import paragraph


def section(cache: Path, short: bool) -> str:
    """The section, from the results in `cache`; runs the dives that are missing there."""
    first, other, count = (SHORT_DRAWN, SHORT_KNOWN, SHORT_COUNT) if short else (DRAWN, KNOWN, COUNT)
    kept, code = Remembered(cache / "unknown.jsonl"), stamp(*ANSWERS)
    jobs = {f"{key}:{code}": job for key, job in unknown_jobs(first, count).items()}
    drawn = [judged(data) for data in kept.fill(jobs, "drawn forces").values()]
    jobs = {f"{key}:{code}": job for key, job in known_jobs(other, count).items()}
    known = [judged(data) for data in kept.fill(jobs, "known effects").values()]
    return page(drawn, known)


def page(drawn: Sequence[Judged], known: Sequence[Judged]) -> str:
    """The section from its dives."""
    lines = [
        "## Unknown forces, drawn by a grammar",
        "",
        *_introduction(drawn, known),
        "",
        *tables.goals(drawn, known),
        "",
        "By part of the grammar:",
        "",
        *tables.by_part(drawn),
        "",
        *tables.misnamed(drawn),
        "",
        *tables.mistaken(known),
        "",
    ]
    return "\n".join(lines)


def _introduction(drawn: Sequence[Judged], known: Sequence[Judged]) -> list[str]:
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
