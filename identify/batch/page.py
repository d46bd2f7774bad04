"""HTML page of a batch: the story of each configuration, each parameter over the dates, and tables of the dives."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.dates import AutoDateLocator, ConciseDateFormatter

from bridge.arrays import Array
from bridge.vehicle.coefficients import BY_NAME, Kind
from identify.batch.dive_causes import EffectSize
from identify.batch.drift import Drift, EffectDrift, Story, chance_words
from identify.batch.rows import Row, Value, by_configuration, diagnosed, names_in
from identify.batch.trend import Trend
from identify.diagnose.words import causes as in_words
from identify.report import cells
from identify.report.cells import Cell, Form, Number, Quantity
from identify.report.page import Figure, Report, Section, Table
from identify.report.plot import DIAMOND, DISC, SQUARE, STYLES, Panel, entitle, side_by_side
from identify.report.tables import meaning
from identify.words import (
    MISSING,
    decimals_for,
    decimals_of,
    unit,
    unit_after,
    utc,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes

PANEL_IN = 1.9
AIR, LEAST_AIR_S = 0.05, 1800.0
"""Margin of the time axis on either side of the dives: this share of the time that they span, at least half an hour."""

WIDEST = 6.0
"""How much of an interval far wider than the others still stretches the plot, in median half widths."""

REAL, NOT_REAL = 1, 2
"""Line styles of a significant and of an insignificant trend."""


@dataclass(frozen=True)
class Point:
    """A value with its 95 % interval at a Unix time; `filled` tells two kinds of points apart."""

    unix_s: float
    value: float
    low95: float
    high95: float
    filled: bool


def panel(
    title: str,
    points: Sequence[Point],
    words: tuple[str, str],
    trend: Trend | None,
    is_real: bool,
    span: tuple[float, float],
) -> Panel:
    """A panel of points over the dates of a `span`; `words`: meaning of filled and hollow points."""

    def draw(box: "Axes") -> None:
        for k, point in enumerate(points):
            first = {"label": "95 % interval"} if k == 0 else {}
            box.plot([utc_time(point.unix_s)] * 2, [point.low95, point.high95], **STYLES[0], **first)
            box.plot([utc_time(point.unix_s)], [point.value], **(DISC if point.filled else DIAMOND))
        box.plot([], [], label=words[0], **DISC)
        box.plot([], [], label=words[1], **DIAMOND)
        reach = _reach(points)
        low, high = float(reach.min()), float(reach.max())
        air = 0.06 * (high - low) or 0.05 * abs(low) or 1.0
        box.set_ylim(low - air, high + air)
        _dress(box, trend, is_real, span)
        entitle(box, title, "")

    return Panel(draw, PANEL_IN)


def _reach(points: Sequence[Point]) -> Array:
    """Values that the y axis must include: every value, and each interval unless it is far wider than the others."""
    value, low, high = np.array([(v.value, v.low95, v.high95) for v in points]).T
    most = WIDEST * float(np.median(high - low)) / 2
    return np.concatenate([np.maximum(low, value - most), np.minimum(high, value + most)])


def voltage_panel(
    volts_at: Sequence[tuple[float, float]], trend: Trend | None, span: tuple[float, float]
) -> Panel:
    """A panel of the mean pack voltage, V, at Unix times."""
    readings = [(utc_time(unix_s), volts) for unix_s, volts in volts_at]

    def draw(box: "Axes") -> None:
        box.plot([when for when, _ in readings], [volts for _, volts in readings], **SQUARE)
        _dress(box, trend, trend is not None and trend.is_real, span)
        entitle(box, "mean pack voltage, V", "")

    return Panel(draw, PANEL_IN)


def _dress(box: "Axes", trend: Trend | None, is_real: bool, span: tuple[float, float]) -> None:
    """Draw the trend and set an axis of dates that spans all dives."""
    if trend is not None:
        ends = (trend.first_s, trend.last_s)
        word = "significant trend" if is_real else "no significant trend"
        style = STYLES[REAL if is_real else NOT_REAL]
        box.plot([utc_time(t) for t in ends], [trend.at(t) for t in ends], label=word, **style)
    air_s = max(AIR * (span[1] - span[0]), LEAST_AIR_S)
    box.set_xlim(utc_time(span[0] - air_s), utc_time(span[1] + air_s))
    locator = AutoDateLocator(maxticks=5)
    box.xaxis.set_major_locator(locator)
    box.xaxis.set_major_formatter(ConciseDateFormatter(locator))


def utc_time(unix_s: float) -> datetime:
    return datetime.fromtimestamp(unix_s, UTC)


MARKS = "?: doubted; ?*: doubted, and in no trend"

HOW = (
    "A trend is a straight line through the values, each weighted by its own standard error and by what dives scatter "
    "beyond it. It is called significant where a slope as large would come up by chance in fewer than one batch of "
    "twenty, among all the parameters of the configuration together. Only values that no doubt is about, of "
    "dives that converged, count, where there are enough of them. Damping over mass does not depend on how much thrust "
    "there really was, mass and damping each do: that tells a fouled hull from weak thrust."
)


NO_EFFECTS: Mapping[str, Sequence[EffectDrift]] = {}


def batch_report(
    vehicle: str,
    method: str,
    rows: Sequence[Row],
    twins: Sequence[tuple[str, str, str]],
    drifts: Mapping[str, Drift],
    effects: Mapping[str, Sequence[EffectDrift]] = NO_EFFECTS,
    conditions: Sequence[str] = (),
) -> Report:
    """Build the page.

    `twins` are the recordings that do not count: each with the reason, and the recording of the same dive that
    counts. `effects`: the drifts of effects by configuration, where the dives were diagnosed. `conditions`: changes of
    the vehicle file by those of the dives, in sentences.
    """
    groups = by_configuration(rows)
    failed = [row for row in rows if not row.values]
    sections = [_configuration(name, group, drifts[name]) for name, group in groups.items()]
    sections += [
        causes_section(name, group, effects.get(name, ())) for name, group in diagnosed(rows).items()
    ]
    sections += [_dives(name, group, drifts[name]) for name, group in groups.items()]
    if failed:
        why = [(row, row.error) for row in failed]
        sections.append(_failures("Dives that gave nothing", "The others count all the same.", why))
    if undiagnosed := [
        (row, row.causes.error) for row in rows if row.values and row.causes and row.causes.error
    ]:
        sections.append(
            _failures("Dives that were not diagnosed", "Their values count all the same.", undiagnosed)
        )
    if twins:
        sections.append(_twins(twins))
    if conditions:
        sections.append(Section("Conditions of the dives", " ".join(conditions)))
    stories = [f"{name}: {drifts[name].story.value}." for name in groups] or ["No dive gave a parameter."]
    stories += [drift.sentence for of_effects in effects.values() for drift in of_effects if drift.is_real]
    counted = f"{len(rows) - len(failed)} of {len(rows)} dives identified by {method}"
    return Report(f"{vehicle}: parameters over dives", counted, " ".join(stories), tuple(sections))


def _configuration(name: str, rows: Sequence[Row], drift: Drift) -> Section:
    figure = _figure(rows, drift)
    return Section(
        f"Configuration {name}",
        f"{drift.sentence}\n\n{HOW}" if drift.story is not Story.TOO_FEW else drift.sentence,
        (_trend_table(rows, drift),),
        (figure,) if figure else (),
    )


def _dives(name: str, rows: Sequence[Row], drift: Drift) -> Section:
    kinds: tuple[tuple[Kind, str], ...] = (("mass", "Masses and inertias"), ("damping", "Dampings"))
    tables = [
        _dive_table(rows, drift, kind, f"{words}, with half the width of each 95 % interval.")
        for kind, words in kinds
    ]
    if any(row.doubted for row in rows):
        tables.append(_doubts(rows))
    return Section(f"Dives of configuration {name}", tables=tuple(tables))


def _trend_table(rows: Sequence[Row], drift: Drift) -> Table:
    lines = []
    for name in names_in(rows):
        trend = drift.trends.get(name)
        count = sum(drift.takes(row, name) for row in rows)
        lines.append((
            BY_NAME[name].symbol, cells.count(count), unit(BY_NAME[name].unit),
            *_trend_cells(trend, name in drift.real), meaning(name),
        ))  # fmt: skip
    columns = (
        "Parameter", "Dives", "Unit", "Mean", "Change, first to last", "95 % interval", "Scatter", "Trend", "Meaning",
    )  # fmt: skip
    return Table(
        columns,
        tuple(lines),
        "Trends, in per cent of where each begins. Scatter: between dives, beside their own intervals.",
    )


def _trend_cells(trend: Trend | None, is_real: bool) -> tuple[Cell, Cell, Cell, Cell, str]:
    if trend is None:
        return MISSING, MISSING, MISSING, MISSING, "can't be told"
    half = (trend.high95 - trend.low95) / 2
    change, low, high = (
        cells.fixed(trend.percent(v), 1, "%") for v in (trend.change, trend.low95, trend.high95)
    )
    word = ("up" if trend.change > 0 else "down") if is_real else "none shown"
    return (
        cells.fixed(trend.mean, decimals_for(half)),
        change,
        cells.joined(Form.RANGE, low, high),
        cells.fixed(trend.percent(trend.scatter), 1, "%"),
        word,
    )


def _dive_table(rows: Sequence[Row], drift: Drift, kind: Kind, caption: str) -> Table:
    names = [name for name in names_in(rows) if BY_NAME[name].kind == kind]
    lines = [
        (
            _date(row),
            *(_cell(row.values.get(name), doubt_mark(row, name, drift)) for name in names),
            row.outcome if drift.counts(row) else f"{row.outcome}: in no trend",
            row.dive,
        )
        for row in rows
    ]
    headings = [f"{BY_NAME[name].symbol}, {unit(BY_NAME[name].unit)}" for name in names]
    marked = any(name in row.doubted for row in rows for name in names)
    return Table(
        ("Date, UTC", *headings, "Outcome", "Dive"), tuple(lines), caption + (f" {MARKS}." if marked else "")
    )


def doubt_mark(row: Row, name: str, drift: Drift) -> str:
    """Mark behind a doubted value: `?`, or `?*` if the doubt keeps it out of the trend; empty without a doubt."""
    if name not in row.doubted:
        return ""
    return "?*" if drift.counts(row) and not drift.takes(row, name) else "?"


def _doubts(rows: Sequence[Row]) -> Table:
    lines = [
        (_date(row), row.dive, ", ".join(about), doubt.sentence)
        for row in rows
        for doubt in row.doubts
        if (about := [name for name in names_in([row]) if name in doubt.about])
    ]
    return Table(
        ("Date, UTC", "Dive", "Doubted", "Why, and what to do"),
        tuple(lines),
        "What is doubted of these dives.",
    )


def _cell(value: Value | None, mark: str) -> Cell:
    if value is None:
        return MISSING
    half = (value.high95 - value.low95) / 2
    decimals = decimals_for(half) if half > 0 else decimals_of(value.value, 4)
    numbers = [Number(each, decimals) for each in (value.value, half)]
    if half <= 0:
        return Quantity((numbers[0],), mark=mark)
    return Quantity(tuple(numbers), form=Form.SPREAD, mark=mark)


def _figure(rows: Sequence[Row], drift: Drift) -> Figure | None:
    """Plot every coefficient, and the battery if logged, over the dates; None if no dive is dated."""
    dated = [row for row in rows if row.unix_s is not None]
    if not dated:
        return None
    times = [row.unix_s or 0.0 for row in dated]
    span = min(times), max(times)
    panels = [_panel(name, dated, drift, span) for name in names_in(dated)]
    readings = [(row.unix_s or 0.0, row.voltage_v) for row in dated if row.voltage_v is not None]
    if readings:
        panels.append(voltage_panel(readings, drift.voltage, span))
    return Figure("parameters over dives", "Each parameter over the date of the dive.", side_by_side(panels))


def _panel(name: str, rows: Sequence[Row], drift: Drift, span: tuple[float, float]) -> Panel:
    points = [
        Point(row.unix_s or 0.0, v.value, v.low95, v.high95, drift.takes(row, name))
        for row in rows
        if (v := row.values.get(name)) is not None
    ]
    title = f"{BY_NAME[name].symbol}, {unit(BY_NAME[name].unit)}"
    words = "in the trend", "another outcome, or doubted: in no trend"
    return panel(title, points, words, drift.trends.get(name), name in drift.real, span)


def _failures(heading: str, text: str, why: Sequence[tuple[Row, str]]) -> Section:
    table = Table(("Dive", "Date, UTC", "Why"), tuple((row.dive, _date(row), reason) for row, reason in why))
    return Section(heading, text, (table,))


def _date(row: Row) -> str:
    return MISSING if row.unix_s is None else utc(row.unix_s)


def _twins(twins: Sequence[tuple[str, str, str]]) -> Section:
    table = Table(("Recording", "Why it does not count", "The one that counts"), tuple(twins))
    return Section("Counted once", "Dives of which more than one recording was given.", (table,))


HOW_SIZES = (
    "Each dive is diagnosed by itself. A size drifts where a straight line through the sizes of all dives has a slope "
    "that chance would seldom give, among all effects looked at. Dives that do not name the effect count, too: "
    "their intervals hold noise alone, and the line takes what dives scatter beyond it into account."
)


def causes_section(configuration: str, rows: Sequence[Row], drifts: Sequence[EffectDrift]) -> Section:
    """The section of one configuration. `rows`: its dives with a diagnosis; `drifts`: of its effects."""
    tables, figures = [_table_of_causes(rows)], list[Figure]()
    if drifts:
        tables.insert(0, _table_of_drifts(drifts))
        panels, words = map(_panel_of_size, drifts), "Each effect's size over the date of the dive."
        figures.append(Figure("sizes of effects over dives", words, side_by_side(list(panels))))
    return Section(
        f"Causes in configuration {configuration}",
        "\n\n".join((*(drift.sentence for drift in drifts if drift.is_real), HOW_SIZES)),
        tuple(tables),
        tuple(figures),
    )


def cause_words(item: EffectSize) -> str:
    """`weak thruster 3, 97 % probable: gain 0.83 (0.80 to 0.86)`, with its rivals."""
    alike = f" (or {', '.join(map(in_words.words, item.also))})" if item.also else ""
    possible = "" if item.named else "possible: "
    return f"{possible}{item.words}{alike}, {in_words.percent_bounded(item.probability)} probable: {item.size_words}"


def _table_of_causes(rows: Sequence[Row]) -> Table:
    lines = [
        (
            _date(row),
            in_words.words(row.causes.verdict),
            "; ".join(cause_words(item) for item in row.causes.found) or MISSING,
            row.dive,
        )
        for row in rows
        if row.causes is not None
    ]
    return Table(
        ("Date, UTC", "Verdict", "Causes, with 95 % intervals", "Dive"), tuple(lines), "What each dive lacks."
    )


def _table_of_drifts(drifts: Sequence[EffectDrift]) -> Table:
    lines = []
    for drift in drifts:
        slope, interval = cells.with_interval(drift.slope, drift.low95, drift.high95, f"per {drift.per}")
        word = ("up" if drift.slope > 0 else "down") if drift.is_real else "none shown"
        lines.append((
            drift.words, f"{drift.parameter}{unit_after(drift.unit)}", cells.count(drift.trend.count),
            cells.count(drift.named), slope, interval, chance_words(drift.chance), word,
        ))  # fmt: skip
    columns = ("Effect", "Parameter", "Dives", "Named in", "Slope", "95 % interval", "By chance", "Drift")
    return Table(columns, tuple(lines), "How the sizes of effects drift.")


def _panel_of_size(drift: EffectDrift) -> Panel:
    points = [
        Point(unix_s, size.value, size.value if size.low95 is None else size.low95,
              size.value if size.high95 is None else size.high95, named)
        for unix_s, size, named in drift.points
    ]  # fmt: skip
    span = drift.trend.first_s, drift.trend.last_s
    title = f"{drift.words}: {drift.parameter}{unit_after(drift.unit)}"
    return panel(title, points, ("named", "not named"), drift.trend, drift.is_real, span)
