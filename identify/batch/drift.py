"""Interprets the trends of a configuration: picks a story from a closed list and puts it into words with figures."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from enum import Enum

import numpy as np

from bridge.vehicle.coefficients import DAMPINGS, MASSES
from identify.batch.rows import NAMES, Row, is_about, names_in
from identify.batch.trend import LEVEL, ONE_MOMENT_S, Series, Trend, common_series, fit_trend, holm, ratio
from identify.identification import Culprit, Outcome
from identify.ingest.open import utc

SOUND = frozenset({Outcome.CONVERGED.value})
WITH_DOUBTS = SOUND | {Outcome.DISAGREES.value}
DOUBTED = (
    "Too few values converged undoubted, so those that a warning names count too, and those of dives in which data and "
    "model disagree, where the recording itself is not doubted: what all err by alike makes no trend, but another "
    "speed or manoeuvre may look like one."
)

VOLTAGE_STD_V = 0.05
"""Standard error, in V, of a dive's mean pack voltage measured by an autopilot. Scatter between dives is fitted on top.
"""


class Story(Enum):
    """Cause of the change over the dives. The value is the sentence that the user reads, before its figures."""

    TOO_FEW = (
        "No trend can be told: it takes masses, or dampings, of three dated dives, not all of one moment"
    )
    STEADY = "No trend shows"
    FOULING = (
        "Damping is up and mass does not change significantly, so more drag: fouling, or gear that drags; clean the "
        "hull"
    )
    CLEANER = (
        "Damping is down and mass does not change significantly, so less drag: a cleaner hull, or gear that no longer "
        "drags"
    )
    WEAKER = (
        "All are up together, which is how less thrust looks than the thruster curve says: battery, worn or fouled "
        "propellers; damping over mass does not change significantly"
    )
    STRONGER = (
        "All are down together, which is how more thrust looks than the thruster curve says: battery, new propellers; "
        "damping over mass does not change significantly"
    )
    HEAVIER = (
        "Mass is up and damping does not change significantly: payload, ballast or water taken in; weigh it"
    )
    LIGHTER = (
        "Mass is down and damping does not change significantly: payload or ballast gone; weigh the vehicle"
    )
    SEVERAL = "Mass and damping change by different shares: more than one cause, such as thrust and fouling, or a refit"
    UNCLEAR = "Something changes, but these dives can't tell drag from thrust: weigh the vehicle, and log the battery"


@dataclass(frozen=True)
class Drift:
    """The story of a configuration. `trends` holds the trend of each coefficient with enough values.

    `real` names the coefficients whose trend is significant after correction for their number (Holm). `mass`,
    `damping` and `damping_over_mass` are trends of logarithms, `voltage` that of the pack voltage in V.
    `despite_doubts`: see `_takes`.
    """

    story: Story
    sentence: str
    trends: Mapping[str, Trend]
    real: frozenset[str]
    mass: Trend | None = None
    damping: Trend | None = None
    damping_over_mass: Trend | None = None
    voltage: Trend | None = None
    despite_doubts: bool = False

    @property
    def reach(self) -> int:
        """How many of mass, damping and their ratio have a trend."""
        return sum(trend is not None for trend in (self.mass, self.damping, self.damping_over_mass))

    def counts(self, row: Row) -> bool:
        """Whether the outcome of a row lets it into the trends."""
        return _counts(row, self.despite_doubts)

    def takes(self, row: Row, name: str) -> bool:
        """Whether the trend of parameter `name` uses the value of this row."""
        return _takes(row, name, self.despite_doubts)


def _counts(row: Row, despite_doubts: bool) -> bool:
    """Whether the outcome of a dive lets its values into a trend."""
    return row.outcome in (WITH_DOUBTS if despite_doubts else SOUND)


def _takes(row: Row, name: str, despite_doubts: bool) -> bool:
    """Whether the trend of `name` uses a row's value: the value exists, the dive converged, and no doubt is about it.

    With `despite_doubts`, three more kinds of value count: those of dives in which data and model disagree, those
    that only a warning is about, and those whose doubt is a force that the model lacks. A value under a graver doubt
    of the recording never counts, because the next dive need not have the same error.
    """
    speaking = [doubt for doubt in row.doubts if is_about(doubt, name)]
    if despite_doubts:
        speaking = [
            d for d in speaking if d.outcome is not Outcome.CONVERGED and d.culprit is not Culprit.MODEL
        ]
    return name in row.values and _counts(row, despite_doubts) and not speaking


def drift_of(rows: Sequence[Row]) -> Drift:
    """Trends and story of the dated rows of a configuration.

    Only undoubted values of converged dives count, if they suffice for trends of mass, damping and their ratio. If
    they don't (as for a vehicle whose drag never fits the model) and doubted values give more of these three trends,
    then those values count too: see `_takes`.
    """
    sound, doubted = (_drift(rows, despite_doubts) for despite_doubts in (False, True))
    if doubted.reach <= sound.reach:
        return sound
    return replace(doubted, sentence=f"{doubted.sentence} {DOUBTED}")


def _drift(rows: Sequence[Row], despite_doubts: bool) -> Drift:
    dated = [
        replace(row, values={name: v for name, v in row.values.items() if _takes(row, name, despite_doubts)})
        for row in rows
        if row.unix_s is not None and row.values and _counts(row, despite_doubts)
    ]
    fits = ((name, _trend_of(dated, name)) for name in names_in(dated))
    trends = {name: trend for name, trend in fits if trend is not None}
    chances = holm({name: trend.p for name, trend in trends.items()})
    real = frozenset(name for name, p in chances.items() if p < LEVEL)
    masses = common_series(dated, [c.name for c in MASSES])
    dampings = common_series(dated, [c.name for c in DAMPINGS])
    mass, damping, over = (_fit(series) for series in (masses, dampings, ratio(dampings, masses, dated)))
    voltage = _voltage(dated)
    story = _story(mass, damping, over, [trends[name] for name in real])
    if story is Story.TOO_FEW:
        sentence = f"{story.value}. {_what_there_is(rows, dated, masses, dampings)}"
    else:
        sentence = _sentence(story, mass, damping, over, voltage) + _left_out(rows, despite_doubts)
    return Drift(story, sentence, trends, real, mass, damping, over, voltage, despite_doubts)


def percent(log_change: float) -> float:
    """Convert a change of a logarithm to per cent."""
    return 100 * float(np.expm1(log_change))


def _fit(series: Series) -> Trend | None:
    return fit_trend(series.unix_s, series.value, series.std)


def _trend_of(rows: Sequence[Row], name: str) -> Trend | None:
    values = [(row.unix_s, row.values[name]) for row in rows if name in row.values]
    return _trend([(unix_s, value.value, value.std) for unix_s, value in values if value.std > 0])


def _trend(points: Sequence[tuple[float | None, float | None, float]]) -> Trend | None:
    """Trend of points (Unix time, value, standard error)."""
    return fit_trend(*np.array(points, dtype=np.float64).reshape(-1, 3).T)


def _voltage(rows: Sequence[Row]) -> Trend | None:
    logged = [row for row in rows if row.voltage_v is not None]
    return _trend([(row.unix_s, row.voltage_v, VOLTAGE_STD_V) for row in logged])


def _story(mass: Trend | None, damping: Trend | None, over: Trend | None, real: Sequence[Trend]) -> Story:
    """Pick the story. Damping over mass does not depend on thrust, so it decides whether the vehicle itself changed.

    The three trends are judged together, with p values corrected for their number (Holm). `real` are the significant
    trends of single coefficients. With only mass or only damping, the story is UNCLEAR if that trend is significant.
    """
    if mass is None or damping is None or over is None:
        only_trend = mass or damping
        if only_trend is None:
            return Story.TOO_FEW
        return Story.UNCLEAR if only_trend.is_real else Story.STEADY
    chances = holm({"mass": mass.p, "damping": damping.p, "over": over.p})
    mass_moves, damping_moves, over_moves = (chances[name] < LEVEL for name in ("mass", "damping", "over"))
    if mass_moves and damping_moves:
        up = mass.change > 0
        together = all((trend.change > 0) == up for trend in (damping, *real))
        if over_moves or not together:
            return Story.SEVERAL
        return Story.WEAKER if up else Story.STRONGER
    if over_moves and mass_moves:
        return Story.HEAVIER if mass.change > 0 else Story.LIGHTER
    if over_moves and damping_moves:
        return Story.FOULING if damping.change > 0 else Story.CLEANER
    return Story.UNCLEAR if mass_moves or damping_moves or over_moves else Story.STEADY


def _sentence(
    story: Story, mass: Trend | None, damping: Trend | None, over: Trend | None, voltage: Trend | None
) -> str:
    longest = max((t for t in (mass, damping) if t is not None), key=lambda t: t.count)
    figures = [
        f"{word} {_change(trend)}" for word, trend in (("mass", mass), ("damping", damping)) if trend is not None
    ]  # fmt: skip
    words = (
        f"{story.value}. Over {longest.count} dives from {utc(longest.first_s)} to {utc(longest.last_s)}: "
    )
    words += f"{', '.join(figures)}."
    word, trend = {
        Story.FOULING: ("mass", mass),
        Story.CLEANER: ("mass", mass),
        Story.HEAVIER: ("damping", damping),
        Story.LIGHTER: ("damping", damping),
        Story.WEAKER: ("damping over mass", over),
        Story.STRONGER: ("damping over mass", over),
    }.get(story, ("", None))
    if trend is not None:
        within = max(abs(percent(trend.low95)), abs(percent(trend.high95)))
        words += f" The change of {word} is within {within:.1f} %."
    if voltage is not None and voltage.is_real:
        way = "fell" if voltage.change < 0 else "rose"
        words += f" The pack voltage {way} by {abs(voltage.change):.1f} V over the same time."
    return words


def _what_there_is(rows: Sequence[Row], dated: Sequence[Row], masses: Series, dampings: Series) -> str:
    """For a configuration with too few dives for a trend: how many are dated, converged, give a mass or a damping."""
    dates, sound = sum(row.unix_s is not None for row in rows), sum(row.outcome in SOUND for row in rows)
    counts = (
        f"A trend takes dives that have a date and converged: of the {len(rows)} identified in this configuration "
        f"{dates} have a date, {sound} converged and {len(dated)} are both"
    )
    if dated:
        counts += f"; {len(masses.rows)} of these give a mass and {len(dampings.rows)} a damping"
        counts += " that no doubt is about" if any(row.doubted for row in rows) else ""
    times = [row.unix_s for row in dated if row.unix_s is not None]
    alike = len(times) > 1 and max(times) - min(times) <= ONE_MOMENT_S
    return f"{counts}; they all began within a minute of each other." if alike else f"{counts}."


def _left_out(rows: Sequence[Row], despite_doubts: bool) -> str:
    """Say how many dives no trend uses and why, and which doubted values of the others; empty if all are used."""
    excluded = [row.outcome for row in rows if row.values and not _counts(row, despite_doubts)]
    why = [f"{excluded.count(outcome)} ended as '{outcome}'" for outcome in dict.fromkeys(excluded)]
    doubted = [
        [name for name in names_in([row]) if not _takes(row, name, despite_doubts)]
        for row in rows
        if _counts(row, despite_doubts)
    ]
    some = [names for names in doubted if names]
    if some:
        names = sorted({name for dive_names in some for name in dive_names}, key=NAMES.index)
        why.append(f"the doubted {', '.join(names)} of {len(some)} dive{'s' if len(some) > 1 else ''}")
    return f" Left out: {' and '.join(why)}." if why else ""


def _change(trend: Trend) -> str:
    """Text such as `+12.3 % (+8.1 to +16.5 % at 95 %)` for a trend of logarithms."""
    change, low, high = (percent(value) for value in (trend.change, trend.low95, trend.high95))
    return f"{change:+.1f} % ({low:+.1f} to {high:+.1f} % at 95 %)"
