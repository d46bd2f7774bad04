"""How a vehicle changes from dive to dive, in words with figures: its hull, and the sizes of effects.

The trends of mass and damping together mean one of a few stories, from fouling to a heavier payload. In other
folders a drift is something else: how far a simulation runs off a dive within 5 s.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from enum import Enum
from typing import Literal

import numpy as np

from bridge.vehicle.coefficients import DAMPINGS, MASSES
from identify.batch.dive_causes import DiveCauses, Size
from identify.batch.rows import NAMES, Row, is_about, names_in
from identify.batch.trend import LEVEL, ONE_MOMENT_S, Series, Trend, common_series, fit_trend, holm, ratio
from identify.doubt import Culprit, Outcome
from identify.words import capital, decimals_for, fixed, significant, unit_after, utc, with_interval

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
    """The meaning of the trends. The value is the sentence that the user reads, before its figures."""

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
    """How a configuration changes: its story, with the trend of each coefficient that has enough values.

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
        return _counts(row, self.despite_doubts)

    def takes(self, row: Row, name: str) -> bool:
        return _takes(row, name, self.despite_doubts)


def _counts(row: Row, despite_doubts: bool) -> bool:
    """Whether date and outcome of a dive let its values into a trend."""
    return row.unix_s is not None and row.outcome in (WITH_DOUBTS if despite_doubts else SOUND)


def _takes(row: Row, name: str, despite_doubts: bool) -> bool:
    """Whether the trend of `name` uses a row's value: the value exists, the dive has a date and converged, and no doubt
    is about it.

    With `despite_doubts`, three more kinds of value count: of dives in which data and model disagree, with a warning
    alone, and with a doubt that the model lacks a force. A value under a graver doubt about the recording never counts,
    because the next dive need not have the same error.
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
        if row.values and _counts(row, despite_doubts)
    ]
    fits = ((name, _trend_of(dated, name)) for name in names_in(dated))
    trends = {name: trend for name, trend in fits if trend is not None}
    chances = holm({name: trend.p for name, trend in trends.items()})
    real = frozenset(name for name, p in chances.items() if p < LEVEL)
    masses = common_series(dated, [c.name for c in MASSES])
    dampings = common_series(dated, [c.name for c in DAMPINGS])
    mass, damping, over = (
        fit_trend(series.unix_s, series.value, series.std)
        for series in (masses, dampings, ratio(dampings, masses, dated))
    )
    voltage = _voltage(dated)
    story = _story(mass, damping, over, [trends[name] for name in real])
    if story is Story.TOO_FEW:
        sentence = f"{story.value}. {_dives_counted(rows, dated, masses, dampings)}"
    else:
        sentence = _sentence(story, mass, damping, over, voltage) + _left_out(rows, despite_doubts)
    return Drift(story, sentence, trends, real, mass, damping, over, voltage, despite_doubts)


def percent(log_change: float) -> float:
    return 100 * float(np.expm1(log_change))


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


def _dives_counted(rows: Sequence[Row], dated: Sequence[Row], masses: Series, dampings: Series) -> str:
    """For a configuration with too few dives for a trend: how many are dated, converged, give a mass or a damping."""
    dates, sound = sum(row.unix_s is not None for row in rows), sum(row.outcome in SOUND for row in rows)
    counts = (
        f"A trend takes dives that have a date and converged. Identified in this configuration: {len(rows)}, with a "
        f"date {dates}, converged {sound}, both {len(dated)}"
    )
    if dated:
        counts += f"; of these {len(masses.rows)} with a mass and {len(dampings.rows)} with a damping"
        counts += " that no doubt is about" if any(row.doubted for row in rows) else ""
    times = [row.unix_s for row in dated if row.unix_s is not None]
    alike = len(times) > 1 and max(times) - min(times) <= ONE_MOMENT_S
    return f"{counts}; they all began within a minute of each other." if alike else f"{counts}."


def _left_out(rows: Sequence[Row], despite_doubts: bool) -> str:
    """Say how many dives no trend uses and why, and which doubted values of the others; empty if all are used."""
    undated = sum(row.unix_s is None for row in rows)
    excluded = [row.outcome for row in rows if row.unix_s is not None and not _counts(row, despite_doubts)]
    why = [f"{undated} without a date"] if undated else []
    why += [f"{excluded.count(outcome)} ended as '{outcome}'" for outcome in dict.fromkeys(excluded)]
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


DAY_S = 86400.0


@dataclass(frozen=True)
class EffectDrift:
    """A parameter of an effect over the dives of one configuration.

    `slope`, `low95` and `high95`: `unit` per `per`; a "dive" where all dives lie within a day. `chance`: probability
    of a slope as large without a drift, corrected for the number of effects that were looked at. `named`: dives that
    name the effect as a cause. `points`: Unix time, size, and whether named, of each dive in the trend.
    """

    label: str
    words: str
    parameter: str
    unit: str
    per: Literal["day", "dive"]
    slope: float
    low95: float
    high95: float
    chance: float
    named: int
    trend: Trend
    points: tuple[tuple[float, Size, bool], ...] = field(repr=False)

    @property
    def is_real(self) -> bool:
        """Whether the drift is significant beside all others that were looked at."""
        return self.chance < LEVEL

    @property
    def sentence(self) -> str:
        begin, end = self.trend.at(self.trend.first_s), self.trend.at(self.trend.last_s)
        decimals = decimals_for(abs(end - begin) or abs(begin) or 1.0)
        of = unit_after(self.unit)
        slope, interval = with_interval(self.slope, self.low95, self.high95)
        its = f"its {self.parameter}" if self.is_real else f"no drift shows; its {self.parameter}"
        return (
            f"{capital(self.words)}: {its} changes by {slope}{of} per {self.per} (95 %: {interval}), from "
            f"{fixed(begin, decimals)}{of} on {utc(self.trend.first_s)} to {fixed(end, decimals)}{of} on "
            f"{utc(self.trend.last_s)}. {self.named} of {self.trend.count} dives name it. Chance alone gives such a "
            f"slope in {chance_words(self.chance)} of campaigns."
        )


def chance_words(chance: float) -> str:
    """A probability in per cent, never 0: `0.3 %`, `under 0.1 %`."""
    return "under 0.1 %" if chance < 0.001 else f"{significant(100 * chance, 2)} %"


def effect_drifts(dives: Sequence[DiveCauses]) -> tuple[EffectDrift, ...]:
    """The trend of each parameter of each effect that a dated dive names as a cause, surest first.

    `dives`: of one configuration. A dive counts with the size that it found, named or not; a dive that shows no size
    of an effect is left out of its trend. None for fewer dives than a trend takes.
    """
    dated = [(dive.unix_s, dive) for dive in dives if dive.unix_s is not None]
    looked_at = dict.fromkeys(
        (item.label, name) for _, dive in dated for item in dive.found if item.named for name in item.sizes
    )
    fits = {}
    for label, name in looked_at:
        points = [
            (unix_s, item.sizes[name], item)
            for unix_s, dive in dated
            if (item := dive.of(label)) is not None and name in item.sizes and item.sizes[name].std > 0
        ]
        trend = fit_trend(
            np.array([unix_s for unix_s, _, _ in points]),
            np.array([size.value for _, size, _ in points]),
            np.array([size.std for _, size, _ in points]),
        )
        if trend is not None:
            fits[label, name] = trend, points
    chances = holm({f"{label} {name}": trend.p for (label, name), (trend, _) in fits.items()})
    drifts = []
    for (label, name), (trend, points) in fits.items():
        days = (trend.last_s - trend.first_s) / DAY_S
        by_day = days >= 1.0
        each = days if by_day else trend.count - 1
        drifts.append(
            EffectDrift(
                label,
                points[0][2].words,
                name,
                points[0][1].unit,
                "day" if by_day else "dive",
                trend.change / each,
                trend.low95 / each,
                trend.high95 / each,
                chances[f"{label} {name}"],
                sum(item.named for _, _, item in points),
                trend,
                tuple((unix_s, size, item.named) for unix_s, size, item in points),
            )
        )
    return tuple(sorted(drifts, key=lambda drift: drift.chance))
