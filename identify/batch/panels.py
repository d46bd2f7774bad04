"""Panels of a batch's page: values with their intervals, or voltages, over the dates of the dives, with their trend."""

from collections.abc import Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.dates import AutoDateLocator, ConciseDateFormatter

from identify.batch.trend import Trend
from identify.dive import Array
from identify.report.plot import DIAMOND, DISC, SQUARE, STYLES, Panel, entitle

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
