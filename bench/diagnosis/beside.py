"""The rivals compared with the diagnosis on the same dives: names, false alarms, and how far the gap closes."""

import math
import statistics
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from bench.diagnosis.goals import figure_words
from bench.diagnosis.rivals.trials import NETWORK, RivalTrial
from bench.diagnosis.trials import Trial
from bench.words import paragraph, table
from identify.challenge.score import WIDE, Answer, Judged, Rate

OURS = "`seatrial diagnose`"
HEAD = (
    "method", "one hidden: named first, or its class", "two hidden: both", "two hidden: at least one", "false alarms",
    "share of all gaps closed", "median shrink", "median s of one core",
)  # fmt: skip


@dataclass(frozen=True)
class Beside:
    """One method on one dive; before, after: rms drift over the axes, in floors of the diagnosis, NaN without data."""

    method: str
    truth: dict[str, Any]
    answer: Answer | None
    seconds: float
    before: float
    after: float

    @property
    def judged(self) -> Judged:
        return Judged(self.truth, self.answer)


def beside(trials: Sequence[Trial], rivals: Sequence[RivalTrial]) -> list[Beside]:
    """All methods on the dives that the rivals were run on."""
    by_name = {trial.name: trial for trial in trials}
    out = []
    for name in dict.fromkeys(str(trial.truth["name"]) for trial in rivals):
        trial = by_name[name]
        out.append(
            _row(OURS, trial.truth, trial.answer, trial.seconds, trial.before, trial.after, trial.floor)
        )
    for rival in rivals:
        floor = by_name[str(rival.truth["name"])].floor
        out.append(
            _row(rival.rival, rival.truth, rival.answer, rival.seconds, rival.before, rival.after, floor)
        )
    return out


def _row(
    method: str,
    truth: dict[str, Any],
    answer: Answer | None,
    seconds: float,
    before: tuple[float, ...],
    after: tuple[float, ...],
    floor: tuple[float, ...],
) -> Beside:
    return Beside(method, truth, answer, seconds, in_floors(before, floor), in_floors(after, floor))


def in_floors(drift: tuple[float, ...], floor: tuple[float, ...]) -> float:
    """Rms over the fitted axes of drift over floor; NaN if no check dive was flown."""
    if not drift or not floor:
        return math.nan
    ratio = np.array(drift) / np.array(floor)
    ratio = ratio[np.isfinite(ratio)]
    return float(np.sqrt(np.mean(ratio**2))) if len(ratio) else math.nan


def lines(results: Sequence[Beside]) -> list[str]:
    """The table of the page."""
    methods = list(dict.fromkeys(result.method for result in results))
    dives = len(results) // max(len(methods), 1)
    rows = []
    for method in methods:
        of_method = [result for result in results if result.method == method]
        cells = [
            method,
            *(_naming(of_method) if method != NETWORK else ["names none", "-", "-", "-"]),
            *_closing(of_method),
            f"{statistics.median(result.seconds for result in of_method):.1f}",
        ]
        rows.append(cells)
    return [
        *paragraph(
            f"Beside other ways, on {dives} of these dives. BIC tries every effect of the same library by itself, in",
            "the same regression, in sample. The sparse regression fits generic terms to the missing force of the same",
            "nominal model and names what survives by a fixed dictionary; its threshold was set on other dives. The",
            "network learns that force from velocity and thrust. Gaps closed: the 5 s drift of the simulated velocity",
            "on check dives with one or two effects hidden, by the same flight and in the same floors (those of the",
            f"diagnosis) for all; the median is of dives with {WIDE:g} floors or more before.",
        ),
        "",
        *table(HEAD, rows),
    ]


def _naming(own: Sequence[Beside]) -> list[str]:
    return [
        _rate(own, "one", Judged.first),
        _rate(own, "two", Judged.both),
        _rate(own, "two", lambda case: any(map(case.right, case.named))),
        _rate(own, "none", lambda case: case.verdict != "no_gap"),
    ]


def _rate(own: Sequence[Beside], kind: str, hit: Callable[[Judged], bool]) -> str:
    """Rate of hits on the dives of a kind."""
    cases = [result.judged for result in own if result.judged.kind == kind]
    return figure_words(Rate(sum(map(hit, cases)), len(cases)))


def _closing(own: Sequence[Beside]) -> list[str]:
    """The share of all gaps that is closed, and the median shrink."""
    flown = [dive for dive in own if math.isfinite(dive.before) and math.isfinite(dive.after)]
    gap = sum(max(dive.before - 1.0, 0.0) for dive in flown)
    wide = [(dive.before - dive.after) / (dive.before - 1.0) for dive in flown if dive.before >= WIDE]
    return [
        f"{100 * sum(dive.before - dive.after for dive in flown) / gap:.0f} %" if gap > 0 else "-",
        f"{100 * statistics.median(wide):.0f} %" if wide else "-",
    ]
