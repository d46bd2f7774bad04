"""The section of docs/benchmarks.md: 240 field dives, each with a drawn vehicle, velocity filter and sea."""

import math
import statistics
from collections import Counter
from collections.abc import Sequence
from functools import partial
from pathlib import Path

from bench.diagnosis.goals import by_size as power_by_size
from bench.diagnosis.goals import figure_words
from bench.field.answers import SOURCES as ANSWERED
from bench.field.answers import Planned, planned_job
from bench.field.draw import DIVE_S, NONE, effects_of
from bench.field.export import COMPANION, Rates
from bench.field.regressions import HORIZONS_S, NAMES
from bench.field.score import Judged, delays_s, false_causes, judged, magnitudes, rate_also, rate_named
from bench.remembered import Remembered
from bench.stamp import makes_answer, reached, stamp
from bench.words import blocks, counted, in_a_word, paragraph, table
from identify.challenge.score import Rate

SOURCES = (*ANSWERED, reached("bench/field/section.py", belongs=makes_answer))
SEED, COUNT = 600_000, 240
SHORT_SEED, SHORT_COUNT = 390_000, 16
"""Nothing is tuned on dives of SEED; the short form, which anyone may look at, uses seeds of development."""


def section(cache: Path, short: bool) -> str:
    seed, count = (SHORT_SEED, SHORT_COUNT) if short else (SEED, COUNT)
    return page(cases_of(cache, seed, count, COMPANION), seed)


def cases_of(cache: Path, seed: int, count: int, rates: Rates) -> list[Judged]:
    dives = [Planned(seed, number, effect, rates) for number, effect in enumerate(effects_of(seed, count))]
    jobs = {f"{dive.name}:{stamp(*ANSWERED)}": partial(planned_job, dive) for dive in dives}
    return [judged(data) for data in Remembered(cache / "field.jsonl").fill(jobs, "field dives").values()]


def page(cases: Sequence[Judged], seed: int) -> str:
    return blocks(
        "## Field dives",
        _introduction(cases, seed),
        goals(cases),
        further_figures(cases),
        paragraph(
            "Power by effect. Sizes over the sea: the rms of what a refit of masses, linear and quadratic dampings",
            "leaves of the planted wrench, over the standard deviation of the sea, in the degree of freedom where it",
            "is largest. Errors of sizes are over what was planted.",
        ),
        by_effect(cases),
        "By size, all effects together:",
        by_size(cases),
        wrong(cases),
        paragraph(
            "Prediction: the check dive, another mission of the same vehicle, foretold from the measured velocity by",
            "recorded thrust and attitude alone, by what was learnt of the dive; medians over the dives of the rms",
            "over windows. The velocity that all begin with and are held against is the one that the diagnosis",
            "smoothed, as late as the autopilot's filter. The regressions know that drag is linear and quadratic, and",
            "seek one delay of thrust on a grid; the last row has the true coefficients, no delay, and nothing of what",
            "hides.",
        ),
        prediction(cases),
    )


def _introduction(cases: Sequence[Judged], seed: int) -> str:
    empty = sum(case.empty for case in cases)
    return paragraph(
        f"{len(cases)} dives of {DIVE_S[0]:g} to {DIVE_S[1]:g} s as a stock ArduSub records them (`bench/field`,",
        f"seed {seed}): no wrench, no DVL, velocity from the autopilot's own filter, 20 to 120 ms late, smoothed over",
        "30 to 200 ms, with 5 to 25 mm/s of coloured noise. Each draws an ROV of 8 to 30 kg with six or eight",
        "thrusters, mostly quadratic drag within a factor of two of a published hull, a pilot, a mixer, the filter,",
        f"and a sea of 0.5 to 3 % of full thrust. {empty} hide nothing, the others one effect each. A cause counts as",
        "named where it is the first of all or accepted (0.5 probable or more) and the verdict is explained or partly,",
        "or where it is accepted and the verdict is ambiguous. Quadratic drag is the hull's own, and counts neither",
        "way. A false cause is an accepted one that is not there.",
    )


NAMED_GOAL, FALSE_EACH, SIZE_GOAL, DELAY_GOAL_S = 0.9, 30, 0.1, 0.02
POINTS, EACH_POINT = 5, 10
BY_EFFECT = (
    "effect", "dives", "named (95 % bounds)", "only as one of several", "sizes over the sea", "smallest named",
    "largest missed", "size error, median", "said instead",
)  # fmt: skip


def goals(cases: Sequence[Judged]) -> str:
    named, wrong, off, late = rate_named(cases), false_causes(cases), magnitudes(cases), delays_s(cases)
    within = Rate(sum(error <= SIZE_GOAL for error in off), len(off))
    punctual = Rate(sum(error <= DELAY_GOAL_S for error in late), len(late))
    words = f"hidden cause named: {100 * NAMED_GOAL:g} %"
    rows = [_goal(words, figure_words(named), named.share, named.share >= NAMED_GOAL)]
    often = (
        f"{wrong} in {len(cases)} dives, one in {len(cases) / wrong:.1f}"
        if wrong
        else f"none in {len(cases)} dives"
    )
    words = f"false causes: at most one in {FALSE_EACH} dives"
    rows.append(_goal(words, often, 0.0, wrong * FALSE_EACH <= len(cases)))
    middle = statistics.median(off) if off else math.nan
    figure = f"median {100 * middle:.0f} %; within it: {figure_words(within)}" if off else "-"
    rows.append(_goal(f"sizes within {100 * SIZE_GOAL:g} %", figure, middle, middle <= SIZE_GOAL))
    slow = statistics.median(late) if late else math.nan
    figure = f"median {1000 * slow:.0f} ms; within it: {figure_words(punctual)}" if late else "-"
    rows.append(_goal(f"delays within {1000 * DELAY_GOAL_S:g} ms", figure, slow, slow <= DELAY_GOAL_S))
    return table(("goal", "figure (95 % bounds)", ""), rows)


def _goal(words: str, figure: str, value: float, met: bool) -> tuple[str, str, str]:
    return words, figure, "nothing to judge" if math.isnan(value) else in_a_word(met)


def further_figures(cases: Sequence[Judged]) -> str:
    hidden, empty = [case for case in cases if not case.empty], [case for case in cases if case.empty]
    named, also = rate_named(cases), rate_also(cases)
    half = (
        f"; counted by half, {100 * (named.hits + 0.5 * also.hits) / named.of:.1f} % are named"
        if named.of
        else ""
    )
    clean = sum(not case.false() for case in empty)
    verdicts = Counter(case.verdict for case in hidden)
    verdicts_empty = Counter(case.verdict for case in empty)
    seconds = [case.seconds for case in cases]
    refused = [f"{case.truth['name']} ({case.refusal})" for case in cases if case.answer is None]
    return paragraph(
        f"Named only among those that an accepted cause could not be told from: {figure_words(also)}{half}.",
        f"Of {len(empty)} dives that hide nothing {clean} came without a false cause",
        f"(verdicts: {_counted(verdicts_empty)}); verdicts where something hides: {_counted(verdicts)}.",
        f"One diagnosis with its check dive: median {statistics.median(seconds):.1f} s of one core, slowest",
        f"{max(seconds):.1f} s. Refused: {'; '.join(refused) if refused else 'none'}.",
    )


def _counted(counts: Counter[str]) -> str:
    return ", ".join(f"{name.replace('_', ' ')} {count}" for name, count in counts.most_common()) or "none"


def by_effect(cases: Sequence[Judged]) -> str:
    rows = []
    for name in sorted({case.effect for case in cases} - {NONE}):
        group = [case for case in cases if case.effect == name]
        hit, missed = [d for d in group if d.by_name()], [d for d in group if not d.by_name()]
        rate = Rate(len(hit), len(group))
        low, high = rate.bounds()
        off = magnitudes(hit)
        cells = (
            f"`{name}`",
            len(group),
            f"{rate.hits} of {rate.of} ({100 * low:.0f} to {100 * high:.0f} %)",
            sum(case.by_also() for case in group),
            f"{min(case.size for case in group):.2f} to {max(case.size for case in group):.2f}",
            f"{min(case.size for case in hit):.2f}" if hit else "-",
            f"{max(case.size for case in missed):.2f}" if missed else "-",
            f"{100 * statistics.median(off):.0f} %" if off else "-",
            counted((d.accepted[0].name if d.accepted else d.verdict.replace("_", " ") for d in missed), 3),
        )
        rows.append(cells)
    return table(BY_EFFECT, rows)


def by_size(cases: Sequence[Judged]) -> str:
    hidden = [case for case in cases if not case.empty]
    named = [(case.size, case.by_name()) for case in hidden]
    rows = [
        (f"{a:.2f} to {b:.2f}", figure_words(rate)) for a, b, rate in power_by_size(named, POINTS, EACH_POINT)
    ]
    return table(("size over the sea", "named (95 % bounds)"), rows)


def wrong(cases: Sequence[Judged]) -> str:
    said, empty = (
        Counter(name for case in some for name in dict.fromkeys(cause.name for cause in case.false()))
        for some in (cases, [case for case in cases if case.empty])
    )
    if not said:
        return "No false cause was accepted."
    rows = [(f"`{name}`", count, empty[name]) for name, count in said.most_common()]
    return table(("accepted, and not there", "dives", "of these hid nothing"), rows)


def prediction(cases: Sequence[Judged]) -> str:
    flown = [case for case in cases if case.drifts]
    heads = [
        f"{axis}, {horizon:g} s"
        for horizon in HORIZONS_S
        for axis in ("level mm/s", "heave mm/s", "yaw mrad/s")
    ]
    rows = []
    for name in NAMES:
        rms = [case.drifts[name] for case in flown if name in case.drifts]
        cells = [
            _median(rms, horizon, axes) for horizon in range(len(HORIZONS_S)) for axes in ((0, 1), (2,), (3,))
        ]
        lost = sum(any(value is None for value in way[-1][:2]) for way in rms)
        rows.append((name, *cells, f"{lost} of {len(rms)}"))
    return table(("by", *heads, "dives in which it ran away"), rows)


def _median(rows: Sequence[Sequence[Sequence[float | None]]], horizon: int, axes: tuple[int, ...]) -> str:
    values = []
    for row in rows:
        parts = [row[horizon][axis] for axis in axes]
        known = [value for value in parts if value is not None]
        if len(known) == len(parts):
            values.append(math.sqrt(statistics.fmean(value**2 for value in known)))
    return f"{1000 * statistics.median(values):.0f}" if values else "-"
