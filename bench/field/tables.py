"""Tables of the field dives: goals, power by effect and by size, false causes, prediction against plain methods."""

import math
import statistics
from collections import Counter
from collections.abc import Sequence

import numpy as np

from bench.field.beside import HORIZONS_S, NAMES
from bench.field.draw import NONE
from bench.field.score import Judged, delays_s, false_causes, magnitudes, rate_also, rate_named
from bench.words import paragraph
from identify.challenge.score import Rate

NAMED_GOAL, FALSE_EACH, SIZE_GOAL, DELAY_GOAL_S = 0.9, 30, 0.1, 0.02
POINTS, EACH_POINT = 5, 10


def told(rate: Rate) -> str:
    """A rate with its 95 % bounds (Wilson 1927)."""
    if not rate.of:
        return "-"
    low, high = rate.bounds()
    return f"{100 * rate.share:.1f} % ({100 * low:.1f} to {100 * high:.1f}), {rate.hits} of {rate.of}"


def goals(cases: Sequence[Judged]) -> list[str]:
    """Each goal with its figure and whether it is met."""
    named, wrong, off, late = rate_named(cases), false_causes(cases), magnitudes(cases), delays_s(cases)
    within = Rate(sum(error <= SIZE_GOAL for error in off), len(off))
    punctual = Rate(sum(error <= DELAY_GOAL_S for error in late), len(late))
    rows = ["| goal | figure (95 % bounds) | |", "|---|---|---|"]
    rows.append(
        _row(
            f"hidden cause named: {100 * NAMED_GOAL:g} %", told(named), named.share, named.share >= NAMED_GOAL
        )
    )
    often = (
        f"{wrong} in {len(cases)} dives, one in {len(cases) / wrong:.1f}"
        if wrong
        else f"none in {len(cases)} dives"
    )
    rows.append(
        _row(f"false causes: at most one in {FALSE_EACH} dives", often, 0.0, wrong * FALSE_EACH <= len(cases))
    )
    middle = statistics.median(off) if off else math.nan
    figure = f"median {100 * middle:.0f} %; within it: {told(within)}" if off else "-"
    rows.append(_row(f"sizes within {100 * SIZE_GOAL:g} %", figure, middle, middle <= SIZE_GOAL))
    slow = statistics.median(late) if late else math.nan
    figure = f"median {1000 * slow:.0f} ms; within it: {told(punctual)}" if late else "-"
    rows.append(_row(f"delays within {1000 * DELAY_GOAL_S:g} ms", figure, slow, slow <= DELAY_GOAL_S))
    return rows


def _row(words: str, figure: str, value: float, met: bool) -> str:
    verdict = "nothing to judge" if math.isnan(value) else "met" if met else "**missed**"
    return f"| {words} | {figure} | {verdict} |"


def beside_goals(cases: Sequence[Judged]) -> list[str]:
    """Further figures next to the goals, in a few sentences."""
    hidden, empty = [case for case in cases if not case.empty], [case for case in cases if case.empty]
    named, also = rate_named(cases), rate_also(cases)
    weighted = (named.hits + 0.5 * also.hits) / named.of if named.of else math.nan
    clean = sum(not case.false() for case in empty)
    verdicts = Counter(case.verdict for case in hidden)
    verdicts_empty = Counter(case.verdict for case in empty)
    seconds = [case.seconds for case in cases]
    refused = [f"{case.truth['name']} ({case.refusal})" for case in cases if case.answer is None]
    return paragraph(
        f"Named only among those that an accepted cause could not be told from: {told(also)}; counted by half,",
        f"{100 * weighted:.1f} % are named. Of {len(empty)} dives that hide nothing {clean} came without a false cause",
        f"(verdicts: {_counted(verdicts_empty)}); verdicts where something hides: {_counted(verdicts)}.",
        f"One diagnosis with its check dive: median {statistics.median(seconds):.1f} s of one core, slowest",
        f"{max(seconds):.1f} s. Refused: {'; '.join(refused) if refused else 'none'}.",
    )


def _counted(counts: Counter[str]) -> str:
    return ", ".join(f"{name.replace('_', ' ')} {count}" for name, count in counts.most_common()) or "none"


def by_effect(cases: Sequence[Judged]) -> list[str]:
    """Table of the power by effect."""
    rows = [
        "| effect | dives | named (95 % bounds) | only as one of several | sizes over the sea | smallest named "
        "| largest missed | size error, median | said instead |",
        "|---" * 9 + "|",
    ]
    for name in sorted({case.effect for case in cases} - {NONE}):
        group = [case for case in cases if case.effect == name]
        hit, missed = [d for d in group if d.by_name()], [d for d in group if not d.by_name()]
        rate = Rate(len(hit), len(group))
        low, high = rate.bounds()
        off = magnitudes(hit)
        cells = [
            f"`{name}`",
            str(len(group)),
            f"{rate.hits} of {rate.of} ({100 * low:.0f} to {100 * high:.0f} %)",
            str(sum(case.by_also() for case in group)),
            f"{min(case.size for case in group):.2f} to {max(case.size for case in group):.2f}",
            f"{min(case.size for case in hit):.2f}" if hit else "-",
            f"{max(case.size for case in missed):.2f}" if missed else "-",
            f"{100 * statistics.median(off):.0f} %" if off else "-",
            _instead(missed),
        ]
        rows.append(f"| {' | '.join(cells)} |")
    return rows


def _instead(missed: Sequence[Judged]) -> str:
    said = Counter(
        case.accepted[0].name if case.accepted else case.verdict.replace("_", " ") for case in missed
    )
    return ", ".join(f"{name} ({count})" for name, count in said.most_common(3)) or "-"


def by_size(cases: Sequence[Judged]) -> list[str]:
    """Table of the power by size over the sea, all effects together."""
    hidden = sorted((one for one in cases if not one.empty), key=lambda one: one.size)
    rows = ["| size over the sea | named (95 % bounds) |", "|---|---|"]
    points = max(min(POINTS, len(hidden) // EACH_POINT), 1)
    for part in np.array_split(np.arange(len(hidden)), points):
        bin_cases = [hidden[i] for i in part]
        if bin_cases:
            rate = Rate(sum(case.by_name() for case in bin_cases), len(bin_cases))
            rows.append(f"| {bin_cases[0].size:.2f} to {bin_cases[-1].size:.2f} | {told(rate)} |")
    return rows


def wrong(cases: Sequence[Judged]) -> list[str]:
    """Table of the causes that were accepted and not present."""
    said = Counter(cause.name for case in cases for cause in case.false())
    empty = Counter(cause.name for case in cases if case.empty for cause in case.false())
    if not said:
        return ["No false cause was accepted."]
    rows = ["| accepted, and not there | dives | of these hid nothing |", "|---|---|---|"]
    return [*rows, *(f"| `{name}` | {count} | {empty[name]} |" for name, count in said.most_common())]


def prediction(cases: Sequence[Judged]) -> list[str]:
    """Drift on check dives by method: medians over the dives of the rms over windows."""
    flown = [case for case in cases if case.drifts]
    heads = [
        f"{axis}, {horizon:g} s"
        for horizon in HORIZONS_S
        for axis in ("level mm/s", "heave mm/s", "yaw mrad/s")
    ]
    rows = [f"| by | {' | '.join(heads)} | dives in which it ran away |", "|---" * (len(heads) + 2) + "|"]
    for name in NAMES:
        rms = [case.drifts[name] for case in flown if name in case.drifts]
        cells = [
            _median(rms, horizon, axes) for horizon in range(len(HORIZONS_S)) for axes in ((0, 1), (2,), (3,))
        ]
        lost = sum(any(value is None for value in way[-1][:2]) for way in rms)
        rows.append(f"| {name} | {' | '.join(cells)} | {lost} of {len(rms)} |")
    return rows


def _median(own: Sequence[Sequence[Sequence[float | None]]], horizon: int, axes: tuple[int, ...]) -> str:
    values = []
    for row in own:
        parts = [row[horizon][axis] for axis in axes]
        known = [value for value in parts if value is not None]
        if len(known) == len(parts):
            values.append(math.sqrt(statistics.fmean(value**2 for value in known)))
    return f"{1000 * statistics.median(values):.0f}" if values else "-"
