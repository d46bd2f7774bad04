"""Plots: what is thinned keeps its extremes and gaps; ticks are round; numbers have no idle digits."""

import re

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from identify.dive import Array, Signal
from identify.report import plot
from identify.report.axes import Axis, close_axis, named_axis, roomy_axis
from identify.report.decimate import broken_at_gaps, envelope
from identify.report.plot import Line, Mark, Panel
from identify.report.text import count, fixed, seconds, significant, unit, with_interval

UNIT = Axis("x", 0.0, 1.0, ((0.0, "0"), (1.0, "1")))


def points(svg: str) -> list[list[tuple[int, int]]]:
    """The strokes of the first path of a plot, in its own whole-number coordinates."""
    found = re.search(r'class="line [a-z]+" d="([^"]*)"', svg)
    assert found
    strokes = []
    for stroke in filter(None, found[1].split("M")):
        numbers = [int(n) for n in re.findall(r"-?\d+", stroke)]
        steps = np.array(numbers).reshape(-1, 2)
        strokes.append([(int(a), int(b)) for a, b in np.cumsum(steps, axis=0)])
    return strokes


@settings(max_examples=30, deadline=None)
@given(st.integers(0, 2**32 - 1), st.integers(1, 3000), st.integers(2, 60))
def test_thinning_keeps_ends_order_and_the_extremes_of_every_stretch(seed: int, n: int, bins: int):
    rng = np.random.default_rng(seed)
    x, y = np.cumsum(rng.uniform(0.01, 1.0, n)), rng.normal(size=n)
    thin_x, thin_y = envelope(x, y, bins)
    assert len(thin_x) <= max(4 * bins, n if n <= 4 * bins else 0)
    assert (np.diff(thin_x) > 0).all()
    assert (thin_x[0], thin_y[0], thin_x[-1], thin_y[-1]) == (x[0], y[0], x[-1], y[-1])
    edges = np.linspace(x[0], x[-1], bins + 1)[1:-1]
    for whole, thin in zip(
        np.split(y, np.searchsorted(x, edges)), np.split(thin_y, np.searchsorted(thin_x, edges)), strict=True
    ):
        if len(whole):
            assert (thin.min(), thin.max()) == (whole.min(), whole.max())


def test_thinning_keeps_one_lone_spike_of_a_million_samples():
    y = np.zeros(1_000_000)
    y[654_321] = 1.0
    x, thin = envelope(np.arange(1e6), y)
    assert len(x) < 2500
    assert x[thin == 1.0].tolist() == [654_321.0]


def test_thinning_keeps_a_gap_wide_enough_to_be_seen_and_no_other():
    y = np.sin(np.arange(100_000) / 999)
    y[40_000:45_000] = np.nan
    y[70_000] = np.nan
    x, thin = envelope(np.arange(1e5), y)
    assert x[np.isnan(thin)].tolist() == [40_000.0]


def test_thinning_what_is_unknown_throughout_leaves_nothing():
    assert len(envelope(np.arange(1e4), np.full(10_000, np.nan))[0]) == 0


def test_a_silence_breaks_the_line():
    signal = Signal(np.array([0.0, 0.1, 0.2, 5.0, 5.1]), np.arange(5.0)[:, None])
    time_s, value = broken_at_gaps(signal, 0, 1.0)
    assert time_s.tolist() == [0.0, 0.1, 0.2, 0.2, 5.0, 5.1]
    assert np.array_equal(value, [0, 1, 2, np.nan, 3, 4], equal_nan=True)


def test_a_line_runs_through_its_points_and_stops_at_nan():
    line = Line(np.array([0.0, 0.5, 0.6, 0.7, 1.0]), np.array([0.0, 1.0, np.nan, 0.5, 0.25]))
    strokes = points(plot.render(Panel(UNIT, UNIT, (line,))))
    assert strokes == [[(0, 1000), (0, 1000), (1000, 0)], [(1400, 500), (1400, 500), (2000, 750)]]


def test_lines_are_told_apart_without_colour():
    lines = [Line(np.zeros(2), np.zeros(2), word, style) for style, word in enumerate(("a", "b", "c", "d"))]
    words = plot.legend(lines)
    assert re.findall(r'class="line (\w+)"', words) == ["solid", "dashed", "dotted", "dashdot"]
    assert re.findall(r"</svg>(\w)</li>", words) == ["a", "b", "c", "d"]


def test_words_in_a_plot_are_escaped():
    axis = Axis("<b>", 0.0, 1.0, ((0.0, "<i>"),))
    svg = plot.render(Panel(axis, axis, (), (Mark(0.5, 0.5, "disc", "<u>"),))) + plot.legend(
        [Line(np.zeros(1), np.zeros(1), "<s>")]
    )
    assert not re.search(r"<[bius]>", svg)
    assert "&lt;u&gt;" in svg


def test_a_stack_labels_its_shared_axis_once():
    svg = plot.stack([Panel(UNIT, UNIT), Panel(UNIT, UNIT)])
    assert svg.count('text-anchor="middle"') == 2


@pytest.mark.parametrize(
    ("low", "high", "labels"),
    [
        (0.0, 417.6, ["0", "200", "400"]),
        (-0.043, 0.041, ["−0.04", "−0.02", "0.00", "0.02", "0.04"]),
        (1.0, 3000.0, ["1000", "2000", "3000"]),
        (7.0, 7.0, ["6.8", "7.0", "7.2"]),
        (0.0, 0.0, ["−1", "0", "1"]),
    ],
)
def test_ticks_are_round_numbers(low: float, high: float, labels: list[str]):
    assert [label for _, label in close_axis("", low, high).ticks] == labels


@settings(max_examples=100, deadline=None)
@given(st.floats(-1e6, 1e6), st.floats(1e-3, 1e6), st.integers(2, 5))
def test_an_axis_has_enough_ticks_within_its_range_and_room_for_them(low: float, span: float, at_least: int):
    axis = close_axis("", low, low + span, at_least)
    values = [value for value, _ in axis.ticks]
    assert at_least <= len(values) <= 3 * at_least
    assert all(axis.low - 1e-5 * span <= value <= axis.high + 1e-5 * span for value in values)
    assert len({label for _, label in axis.ticks}) == len(values)


def test_an_axis_around_nothing_known_still_stands():
    axis = roomy_axis("y", [np.full(3, np.nan)])
    assert axis.low < 0 < 1 < axis.high


def test_depth_grows_downwards():
    axis = close_axis("depth, m", 0.0, 4.0).reversed()
    assert (axis.percent(0.0), axis.percent(4.0)) == (100.0, 0.0)


def test_names_stand_from_top_to_bottom():
    axis = named_axis(["a", "b"])
    assert axis.percent(0.0) > axis.percent(1.0)
    assert [label for _, label in axis.ticks] == ["a", "b"]


@pytest.mark.parametrize(
    ("value", "low", "high", "told"),
    [
        (111.9123, 110.54, 113.28, ("111.9", "110.5 to 113.3")),
        (24.4, 24.3871, 24.4129, ("24.400", "24.387 to 24.413")),
        (12345.0, 11000.0, 13690.0, ("12300", "11000 to 13700")),
        (-0.02, -0.5, 0.46, ("−0.02", "−0.50 to 0.46")),
        (5.0, float("nan"), float("nan"), ("5.000", "—")),
        (float("nan"), float("nan"), float("nan"), ("—", "—")),
    ],
)
def test_a_value_has_the_digits_that_its_interval_allows(
    value: float, low: float, high: float, told: tuple[str, str]
):
    assert with_interval(value, low, high) == told


def test_numbers_read_well():
    assert [significant(v) for v in (0.0, 0.0021149, 1234.0, -3.0, 99.95, float("inf"))] == [
        "0",
        "0.00211",
        "1230",
        "−3.00",
        "100",
        "—",
    ]
    assert fixed(-0.0001, 2) == "0.00"
    assert count(10442) == "10\u00a0442"
    assert [seconds(s) for s in (0.04, 41.23, 417.65, 7260.0)] == [
        "0.040 s",
        "41.2 s",
        "6 min 58 s",
        "2 h 1 min",
    ]
    assert [unit(u) for u in ("kg", "kg m2", "kg/m3", "N m/(rad/s)")] == [
        "kg",
        "kg m²",
        "kg/m³",
        "N m/(rad/s)",
    ]


def test_a_long_noisy_line_stays_small():
    noise: Array = np.random.default_rng(0).normal(size=200_000)
    x = np.arange(200_000.0)
    svg = plot.render(Panel(close_axis("x", 0.0, 2e5), roomy_axis("y", [noise]), (Line(x, noise),)))
    assert len(svg) < 30_000
