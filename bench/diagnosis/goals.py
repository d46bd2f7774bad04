"""The goals of the diagnosis, each with its figure and whether it is met."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from bench.words import blocks, in_a_word, paragraph, table
from identify.challenge.score import CLEAR, WIDE, Measure, Rate, Score


@dataclass(frozen=True)
class Goal:
    """A goal in words, its measure, and the limits of that measure's figure; percent: how the figure is told."""

    words: str
    measure: Measure
    least: float = -math.inf
    most: float = math.inf
    percent: bool = True

    def row(self, score: Score) -> tuple[str, str, str]:
        figure = figure_of(score, self.measure)
        if figure is None or (isinstance(figure, Rate) and not figure.of):
            return self.words, "-", "nothing to judge"
        value = figure.share if isinstance(figure, Rate) else figure
        return self.words, figure_words(figure, self.percent), in_a_word(self.least <= value <= self.most)


def figure_of(score: Score, measure: Measure) -> Rate | float | None:
    """A measure's rate or number; None if no case gives one."""
    return score.rates[measure] if measure in score.rates else score.numbers[measure]


def figure_words(figure: Rate | float | None, percent: bool = True) -> str:
    if figure is None or (isinstance(figure, Rate) and not figure.of):
        return "-"
    if isinstance(figure, Rate):
        low, high = figure.bounds()
        return (
            f"{100 * figure.share:.1f} % ({100 * low:.1f} to {100 * high:.1f}), {figure.hits} of {figure.of}"
        )
    return f"{100 * figure:.1f} %" if percent else f"{figure:.2f}"


EACH_POINT = 30
"""Least number of dives in a point of a power curve."""


def by_size(
    hits: Sequence[tuple[float, bool]], points: int, each: int = EACH_POINT
) -> list[tuple[float, float, Rate]]:
    """Power by size: smallest and largest size of each point, and the rate of hits.

    `hits`: size of an effect, and whether it was named. Points hold equally many dives, at least `each` unless there
    are fewer in all.
    """
    ordered = sorted(hits)
    points = max(min(points, len(ordered) // each), 1)
    parts = [[ordered[i] for i in part] for part in np.array_split(np.arange(len(ordered)), points)]
    return [
        (bin_sizes[0][0], bin_sizes[-1][0], Rate(sum(hit for _, hit in bin_sizes), len(bin_sizes)))
        for bin_sizes in parts
        if bin_sizes
    ]


GOALS = (
    Goal("cause named first, or one of its true class: 97 %", Measure.NAMED_FIRST, 0.97),
    Goal("both of two named: 90 %", Measure.BOTH_NAMED, 0.90),
    Goal("mean class size under 1.5", Measure.CLASS_SIZE, most=1.5, percent=False),
    Goal("right degree of freedom: 99 %", Measure.RIGHT_DOF, 0.99),
    Goal("false alarms: 1 %", Measure.FALSE_ALARMS, most=0.01),
    Goal("unknown called unknown: 90 %", Measure.UNKNOWN_AS_UNKNOWN, 0.90),
    Goal("known called unknown: 2 %", Measure.KNOWN_AS_UNKNOWN, most=0.02),
    Goal(
        "predicted shrink within 5 points of the measured (mean of the differences' sizes)",
        Measure.SHRINK_ERROR,
        most=0.05,
    ),
    Goal("90 % of the closable gap closed, on check dives", Measure.GAP_CLOSED, 0.90),
    Goal(
        "expected calibration error of the probabilities: 0.05",
        Measure.CALIBRATION_ERROR,
        most=0.05,
        percent=False,
    ),
)
"""Judged by the figure itself; the 95 % bounds (Wilson 1927) are shown next to it."""

ALSO = (
    ("cause named first, or among those that the answer calls equally likely", Measure.FIRST_OR_ALIKE),
    (f"the same where it is {CLEAR:g} or more over the floor", Measure.CLEAR_NAMED_FIRST),
    (f"both of two named, each {CLEAR:g} or more over the floor by itself", Measure.CLEAR_BOTH_NAMED),
    ("right degree of freedom, where a gap is told", Measure.RIGHT_DOF_OF_GAP),
    ("false alarms where the disturbance has one pole", Measure.FALSE_ALARMS_ONE_POLE),
    (f"unknown, {CLEAR:g} or more over the floor, called unknown", Measure.CLEAR_UNKNOWN_AS_UNKNOWN),
    ("unknown called no gap", Measure.UNKNOWN_AS_NO_GAP),
    ("known called no gap", Measure.KNOWN_AS_NO_GAP),
    ("taken up whole by a refit: no gap, or named", Measure.ABSORBED_OR_NAMED),
    ("one hidden: magnitudes within their 95 % intervals", Measure.MAGNITUDES_INSIDE),
    ("two hidden: magnitudes within their 95 % intervals", Measure.TWO_MAGNITUDES_INSIDE),
    ("causes named that do not hide, a dive", Measure.WRONG_CAUSES),
    ("one hidden: magnitude error, median", Measure.MAGNITUDE_ERROR),
    ("two hidden: magnitude error, median", Measure.TWO_MAGNITUDE_ERROR),
    ("predicted less measured shrink, median size", Measure.SHRINK_ERROR_MEDIAN),
    (
        f"predicted less measured shrink, mean size, where the check dive drifts {WIDE:g} floors or more before",
        Measure.SHRINK_ERROR_WIDE,
    ),
    ("measured shrink, median", Measure.SHRINK),
)


def words(score: Score) -> str:
    rows = [
        (what, figure_words(figure_of(score, measure), measure is not Measure.WRONG_CAUSES))
        for what, measure in ALSO
    ]
    return blocks(
        table(("goal", "figure (95 % bounds)", ""), [goal.row(score) for goal in GOALS]),
        "Beside them:",
        table(("what", "figure"), rows),
        paragraph(
            "A goal is judged by the figure itself. A dive that the diagnosis refused names nothing, tells no degree",
            "of freedom and has no verdict, and where nothing hides it is left out of the false alarms. The true class",
            "holds the causes that no method can tell apart from such a recording",
            "(`identify/challenge/indistinguishable.py`).",
            "How large an effect truly is, is told by the library's form that comes nearest to what was planted, over",
            "that dive (`identify/challenge/nearest_parameters.py`); the error of a magnitude is over that.",
        ),
    )
