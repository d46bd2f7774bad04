"""Strip charts: exact dots, gaps that show, ranges that stand still, values that are never bright when they are old."""

import math
from dataclasses import replace
from itertools import product

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from made_view import NOW_S, traces

from gcs_plugin.watch.picture import Freshness, Trace
from identify.words import nice_step
from tui.app.curves import BLANK, Scale, braille, curve_row, dots, extremes, scale_for, tick_labels
from tui.app.screens.strip_chart import QUANTITIES, chart

FRESH, STALE, GONE = Freshness
EDGES = np.arange(0.0, 10.5, 0.5)


def joined(line):
    return "".join(text for text, _ in line)


def lines_of(key, cells=46, rows=6, **changes):
    return chart(QUANTITIES[key], replace(traces()[key], **changes), NOW_S, cells, rows)


def bits(on):
    return "".join(chr(code) for code in braille(np.array(on, dtype=bool)).ravel())


def test_each_dot_has_its_place_in_the_cell():
    assert bits([[1, 0], [0, 0], [0, 0], [0, 0]]) == "⠁"
    assert bits([[0, 0], [0, 0], [0, 0], [0, 1]]) == "⢀"
    assert bits([[1, 1], [1, 1], [1, 1], [1, 1]]) == "⣿"


def test_a_line_is_drawn_between_its_readings_and_a_short_peak_between_two_edges_is_not_lost():
    time_s = np.arange(0.0, 11.0, 1.0)
    low, high = extremes(time_s, time_s, EDGES)
    assert low == pytest.approx(EDGES[:-1])
    assert high == pytest.approx(EDGES[1:])
    time_s = np.linspace(0, 10, 101)
    assert extremes(time_s, np.where(np.arange(101) == 42, 5.0, 0.0), EDGES)[1].max() == 5.0


def test_what_is_no_number_and_a_silence_of_over_three_intervals_are_gaps_and_a_shorter_one_is_none():
    time_s = np.arange(0.0, 10.01, 0.25)
    low, _ = extremes(time_s, np.where((time_s > 3.9) & (time_s < 6.1), np.nan, 1.0), EDGES)
    assert np.isnan(low[8:12]).all()
    assert np.isfinite([*low[:7], *low[13:]]).all()
    time_s = np.concatenate([np.arange(0, 4, 0.25), np.arange(4.25, 6, 0.25), np.arange(7.5, 10.1, 0.25)])
    low, _ = extremes(time_s, np.ones_like(time_s), EDGES)
    assert np.isnan(low[12:14]).all()
    assert np.isfinite(low[:11]).all()


@settings(max_examples=60)
@given(
    st.lists(st.tuples(st.floats(-2, 12), st.floats(-5, 5) | st.just(math.nan)), max_size=40),
    st.integers(1, 6),
)
def test_any_readings_draw_within_their_extremes_and_rows(readings, rows):
    readings.sort()
    time_s, value = (np.array([r[n] for r in readings]) for n in (0, 1))
    low, high = extremes(time_s, value, EDGES)
    known = np.isfinite(low)
    assert (np.isfinite(high) == known).all()
    assert (low[known] <= high[known]).all()
    if known.any():
        assert np.nanmin(value) - 1e-9 <= low[known].min()
        assert high[known].max() <= np.nanmax(value) + 1e-9
    drawn = dots(low, high, -5.0, 5.0, rows)
    assert drawn.shape == (4 * rows, len(low))
    assert (drawn.any(axis=0) == known).all()


@pytest.mark.parametrize(
    ("least", "step"), [(0.1, 0.1), (0.11, 0.2), (0.3, 0.5), (6.0, 10.0), (0.05, 0.05), (49, 50)]
)
def test_steps_are_one_two_or_five(least, step):
    assert nice_step(least) == pytest.approx(step)


@settings(max_examples=60)
@given(st.lists(st.floats(-50, 50), max_size=8), st.floats(0.1, 20), st.booleans())
def test_a_scale_holds_its_values_and_spans_enough(values, least, with_zero):
    scale = scale_for(np.array(values), least, with_zero)
    held = [*values, *([0.0] if with_zero else [])]
    assert all(scale.low - 1e-6 <= value <= scale.high + 1e-6 for value in held)
    assert scale.high - scale.low >= least * (1 - 1e-6)
    for end in (scale.low, scale.high):
        assert end / scale.step == pytest.approx(round(end / scale.step), abs=1e-6)


NEVER = {
    "time_s": np.array([]),
    "value": np.array([]),
    "reference": None,
    "age_s": math.inf,
    "freshness": GONE,
}
NO_NUMBER = {"value": np.append(traces()["u"].value[:-1], math.nan)}


@pytest.mark.parametrize(
    ("key", "changes", "words"),
    [
        ("u", {}, "surge u 0.349 m/s ref 0.400"),
        ("r", {}, "yaw r -9.0 deg/s ref -8.1"),
        ("voltage", {}, "battery 15.90 V 4.2 s ago"),
        ("current", {}, "current -- A 14 s ago"),
        ("u", NEVER, "surge u -- m/s not yet"),
        ("u", NO_NUMBER, "surge u -- m/s ref 0.400"),
    ],
    ids=["fresh", "in degrees", "stale", "gone", "never heard", "no number"],
)
def test_the_head_tells_value_unit_and_reference_or_age(key, changes, words):
    assert " ".join(joined(lines_of(key, **changes)[0]).split()) == words


def test_a_stale_value_and_its_curve_are_dimmed():
    assert ("  0.349", "strong") in lines_of("u")[0]
    assert {role for line in lines_of("voltage") for _, role in line}.isdisjoint({"strong", "accent"})


def test_a_gap_is_marked_at_the_bottom_and_the_last_moment_is_none():
    lines = lines_of("v")
    assert "░░░" in joined(lines[-1])
    assert not joined(lines[-1]).endswith("░")
    assert "░" not in "".join(joined(line) for line in lines_of("u"))


def test_deep_is_down():
    rows = lines_of("depth", value=np.linspace(1.0, 3.0, len(traces()["depth"].value)), reference=None)
    assert float(joined(rows[1])[:6]) < float(joined(rows[-1])[:6])
    assert joined(rows[1]).rstrip()[-1] == "┤" or joined(rows[-1]).rstrip()[-1] != " "
    assert len(joined(rows[-1]).rstrip()) > len(joined(rows[1]).rstrip())


def headings(value, reference=None, rows=8):
    """The chart of headings, deg, at the instants of the trace."""
    value, reference = (None if heading is None else np.radians(heading) for heading in (value, reference))
    trace = replace(traces()["heading"], value=value, reference=reference)
    return chart(QUANTITIES["heading"], trace, NOW_S, 60, rows)


def test_a_heading_about_north_is_one_curve_and_its_reference_lies_by_it():
    t = traces()["heading"].time_s
    rows = headings((359.98 + 0.3 * np.sin(t)) % 360, np.zeros_like(t))
    now = f"{round(359.98 + 0.3 * math.sin(t[-1]), 1) % 360:.1f}"
    assert joined(rows[0]).split()[1:] == [now, "deg", "ref", "0.0"]
    drawn = [{role for text, role in row[1:] if set(text) - set(" ┈░")} for row in rows[1:]]
    assert [roles for roles in drawn if roles] == [{"accent", "reference"}]
    ticks = [joined(row)[:7].strip() for row in rows[1:] if "┤" in joined(row)]
    assert ticks == ["10┤", "5┤", "355┤", "350┤"]


def test_wide_headings_have_ticks_at_the_points_of_the_compass_and_over_a_turn_run_from_0_to_360():
    t = traces()["heading"].time_s
    labels = [joined(row)[:6].strip() for row in headings(60 * np.sin(t / 9), rows=12)[1:-1]]
    assert [label for label in labels if label] == ["90", "45", "0", "315", "270"]
    turning = headings(20 * t % 360)
    assert (joined(turning[1])[:7].strip(), joined(turning[-1])[:7].strip()) == ("0┤", "0┤")


def test_a_chart_of_nothing_has_no_axis():
    for changes in (NEVER, {"time_s": traces()["u"].time_s - 90.0, "age_s": 90.0, "freshness": GONE}):
        head, *body = lines_of("u", **changes)
        assert joined(head).startswith("surge u")
        assert body == [()] * 5


@pytest.mark.parametrize("key", ["u", "heading", "depth", "voltage"])
def test_a_chart_is_as_many_rows_as_it_has_and_no_curve_is_wider(key):
    for cells, rows in product((12, 46), (1, 2, 3, 9)):
        lines = lines_of(key, cells, rows)
        assert len(lines) == rows
        assert all(len(joined(line)) <= cells for line in lines[1:]), (cells, rows)


def test_one_row_of_curve_has_no_tick_for_no_scale_is_seen_in_it():
    assert tick_labels(Scale(0.0, 0.5, 0.1), 1, False) == {}
    assert tick_labels(Scale(0.0, 0.5, 0.5), 2, False) == {0: "0.5", 1: "0.0"}


def test_one_row_holds_the_value_and_blocks():
    line = joined(lines_of("altitude", 46, 1)[0])
    assert line.startswith("altitude     1.85 m")
    assert set(line[23:].strip()) <= set("▁▂▃▄▅▆▇█ ")
    assert len(line) == 46


def test_a_trace_with_one_reading_is_a_dot():
    trace = Trace("u", "m/s", np.array([NOW_S - 1.0]), np.array([0.1]), None, 0.1, FRESH)
    drawn = "".join(joined(line)[7:] for line in chart(QUANTITIES["u"], trace, NOW_S, 46, 6)[1:])
    assert len([c for c in drawn if 0x2800 < ord(c) < 0x2900]) == 1


def test_both_curves_are_seen_where_they_share_cells_and_the_reference_lies_over_the_grid():
    measured, asked = np.array([*[0x2809] * 5, BLANK, BLANK]), np.array([*[0x2840] * 6, BLANK])
    row = curve_row(measured, asked, np.zeros(7, dtype=bool), "┈", "accent")
    assert row == (
        ("⡉", "reference"), ("⠉⠉⠉", "accent"), ("⡉⡀", "reference"), ("┈", "rule"),
    )  # fmt: skip


@pytest.mark.parametrize("rows", [1, 3, 6, 12])
@pytest.mark.parametrize("value", [1e30, -1e30, 3.4e38, 1e15])
@pytest.mark.parametrize("key", ["depth", "altitude", "u"])
def test_a_damaged_reading_of_any_size_that_stands_still_is_drawn_like_another(key, value, rows):
    trace = traces()[key]
    assert len(lines_of(key, 120, rows, value=np.full_like(trace.value, value))) == rows
