"""The goals of the diagnosis, each with its figure and whether it is met."""

import math
from collections.abc import Callable
from dataclasses import dataclass

from bench.words import in_a_word, paragraph, table
from identify.challenge.score import CLEAR, WIDE, Rate, Score


@dataclass(frozen=True)
class Goal:
    """A goal in words; figure: computes it from a score, None without data; least, most: limits of the figure."""

    words: str
    figure: Callable[[Score], Rate | float | None]
    least: float = -math.inf
    most: float = math.inf
    percent: bool = True

    def row(self, score: Score) -> tuple[str, str, str]:
        """A row of the table."""
        figure = self.figure(score)
        if figure is None or (isinstance(figure, Rate) and not figure.of):
            return self.words, "-", "nothing to judge"
        value = figure.share if isinstance(figure, Rate) else figure
        return self.words, figure_words(figure, self.percent), in_a_word(self.least <= value <= self.most)


def figure_words(figure: Rate | float | None, percent: bool = True) -> str:
    """A rate with its bounds, or a number."""
    if figure is None or (isinstance(figure, Rate) and not figure.of):
        return "-"
    if isinstance(figure, Rate):
        low, high = figure.bounds()
        return (
            f"{100 * figure.share:.1f} % ({100 * low:.1f} to {100 * high:.1f}), {figure.hits} of {figure.of}"
        )
    return f"{100 * figure:.1f} %" if percent else f"{figure:.2f}"


def rate(name: str) -> Callable[[Score], Rate]:
    """A function that takes a rate from a score, by the beginning of its sentence."""

    def of(score: Score) -> Rate:
        (wanted,) = [value for words, value in score.rates.items() if words == name]
        return wanted

    return of


def number(name: str) -> Callable[[Score], float | None]:
    return lambda score: score.numbers[name]


GOALS = (
    Goal(
        "cause named first, or one of its true class: 97 %",
        rate("one hidden: named first"),
        0.97,
    ),
    Goal("both of two named: 90 %", rate("two hidden: both named"), 0.90),
    Goal("mean class size under 1.5", number("mean class size"), most=1.5, percent=False),
    Goal("right degree of freedom: 99 %", rate("right degree of freedom"), 0.99),
    Goal("false alarms: 1 %", rate("false alarms where nothing hides"), most=0.01),
    Goal("unknown called unknown: 90 %", rate("unknown called unknown"), 0.90),
    Goal("known called unknown: 2 %", rate("known called unknown"), most=0.02),
    Goal(
        "predicted shrink within 5 points of the measured (mean of the differences' sizes)",
        number("predicted less measured shrink, mean size"),
        most=0.05,
    ),
    Goal(
        "90 % of the closable gap closed, on check dives",
        number("share of all gaps on check dives that is closed"),
        0.90,
    ),
    Goal(
        "expected calibration error of the probabilities: 0.05",
        number("calibration error of probabilities"),
        most=0.05,
        percent=False,
    ),
)
"""Judged by the figure itself; the 95 % bounds (Wilson 1927) are shown next to it."""

ALSO = (
    (
        "cause named first, or among those that the answer calls equally likely",
        "one hidden: named first, or called equally likely",
    ),
    (
        f"the same where it is {CLEAR:g} or more over the floor",
        f"one hidden, {CLEAR:g} or more over the floor: named first",
    ),
    (
        f"both of two named, each {CLEAR:g} or more over the floor by itself",
        f"two hidden, each {CLEAR:g} or more over the floor by itself: both named",
    ),
    ("right degree of freedom, where a gap is told", "where a gap is told: right degree of freedom"),
    (
        "false alarms where the disturbance has one pole",
        "false alarms where the disturbance has one pole, as the nominal model takes it",
    ),
    (
        f"unknown, {CLEAR:g} or more over the floor, called unknown",
        f"unknown, {CLEAR:g} or more over the floor: called unknown",
    ),
    ("unknown called no gap", "unknown: called no gap"),
    ("known called no gap", "known called no gap"),
    ("taken up whole by a refit: no gap, or named", "taken up by a refit: no gap, or named"),
    ("one hidden: magnitudes within their 95 % intervals", "magnitudes within their 95 % intervals"),
    (
        "two hidden: magnitudes within their 95 % intervals",
        "two hidden: magnitudes within their 95 % intervals",
    ),
)

NUMBERS = (
    ("causes named that do not hide, a dive", "causes named that do not hide, a case", False),
    ("one hidden: magnitude error, median", "magnitude error, median", True),
    ("two hidden: magnitude error, median", "two hidden: magnitude error, median", True),
    ("predicted less measured shrink, median size", "predicted less measured shrink, median size", True),
    (
        f"predicted less measured shrink, mean size, where the check dive drifts {WIDE:g} floors or more before",
        f"predicted less measured shrink, mean size, of gaps of {WIDE:g} floors or more",
        True,
    ),
    ("measured shrink, median", "measured shrink, median", True),
)


def lines(score: Score) -> list[str]:
    """The goals, and the other figures of the score."""
    rows = [(words, figure_words(score.rates[name])) for words, name in ALSO]
    rows += [(words, figure_words(score.numbers[name], percent)) for words, name, percent in NUMBERS]
    return [
        *table(("goal", "figure (95 % bounds)", ""), [goal.row(score) for goal in GOALS]),
        "",
        "Beside them:",
        "",
        *table(("what", "figure"), rows),
        "",
        *paragraph(
            "A goal is judged by the figure itself. A dive that the diagnosis refused counts as wrong. The true class",
            "holds the causes that no method can tell apart from such a recording (`identify/challenge/score.py`).",
            "How large an effect truly is, is told by the library's form that comes nearest to what was planted, over",
            "that dive (`identify/challenge/nearest_parameters.py`); the error of a magnitude is over that.",
        ),
    ]
