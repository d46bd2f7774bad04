"""Curves over time: zoomed by buttons without any script, thin enough for a page that is mailed."""

import re
from dataclasses import replace

import numpy as np
import pytest
from made_diagnoses import diagnosis, prediction, read

from identify.diagnose.result import Disturbance
from identify.report.diagnosis import diagnosis_report
from identify.report.diagnosis_figures import FLOWN, STYLE_OF
from identify.report.page import render_report
from identify.report.plot import LIGHT, STYLES
from identify.report.traces import STYLE, Traces, render

pytestmark = pytest.mark.usefixtures("sketched")


def traces(n=500, panels=1):
    time_s = 0.04 * np.arange(n)
    wave = np.sin(time_s)
    panel = "surge, m/s", np.array([wave, wave + 0.1, wave + 0.2])
    labels = ("measured", "before", "after")
    return Traces("velocities", "What they are.", labels, time_s, np.arange(n) // 125, (panel,) * panels)


def test_measured_is_one_curve_and_simulated_ones_start_anew_with_every_window():
    paths = re.findall(r'<path class="curve curve\d" d="(M[^"H]*)"', render(traces(), "a"))
    assert [path.count("M") for path in paths] == [1, 4, 4]


def test_a_curve_breaks_where_nothing_is_known_and_one_of_which_nothing_is_known_is_not_drawn():
    wave = np.sin(0.04 * np.arange(500))
    holed, nothing = np.where(np.arange(500) // 100 == 2, np.nan, wave), np.full(500, np.nan)
    kinds = ("mode0", "mode1", "reference")
    drawn = replace(
        traces(),
        block=np.zeros(500, dtype=int),
        panels=(("speed", np.array([wave, nothing, holed])),),
        kinds=kinds,
    )
    paths = re.findall(r'<path class="curve (\w+)" d="(M[^"H]*)"', render(drawn, "a"))
    assert [(kind, path.count("M")) for kind, path in paths] == [("mode0", 1), ("reference", 2)]


def test_after_a_lone_reading_between_two_gaps_the_curve_goes_on():
    wave = np.sin(0.04 * np.arange(500))
    wave[[100, 102, 499]] = np.nan
    alone = replace(traces(), panels=(("speed", wave[None]),))
    (path,) = re.findall(r'<path class="curve curve0" d="(M[^"H]*)"', render(alone, "a"))
    # A browser draws a path as far as its first command without numbers, and no further.
    assert [len(re.findall(r"-?\d+", part)) for part in re.split("[Ml]", path)[1:]] == [2, 200, 2, 2, 2, 792]


def test_an_hour_in_six_degrees_of_freedom_stays_below_a_megabyte():
    long = traces(90_000, 6)
    html = render(replace(long, block=np.arange(90_000) // 90_000), "a")
    assert len(html) < 1e6
    assert html.count(" ") < 6 * 3 * 2.5 * 3000
    still = replace(traces(), panels=(("heave, m/s", np.zeros((3, 500))),))
    assert "nan" not in render(still, "a")


def test_a_silence_of_ten_seconds_breaks_the_curve_of_a_long_dive_too_and_a_panel_of_nothing_is_left_out():
    n = 30_000
    time_s = 0.02 * np.arange(n) + np.where(np.arange(n) < 14_990, 0.0, 10.0)
    wave = np.sin(time_s)[None]
    panels = (("surge, m/s", wave), ("sway, m/s", np.full((1, n), np.nan)))
    html = render(Traces("v", "w", ("measured",), time_s, np.zeros(n, dtype=int), panels), "a")
    assert [path.count("M") for path in re.findall(r'<path class="curve curve0" d="(M[^"H]*)"', html)] == [2]
    assert "sway" not in html


def test_the_page_shows_measured_beside_simulated_on_the_check_dive_or_else_held_out():
    page = read(diagnosis(prediction=prediction("lap-4"), held=prediction("pieces held out")))
    assert "3.1 Measured and simulated" in page
    assert "On the check dive, lap-4." in page
    assert "yaw, deg/s" in page
    held = read(diagnosis(held=prediction("pieces held out")))
    assert "On pieces held out of the fit." in held
    assert "3.1 Measured" not in read(diagnosis())
    assert len(render_report(diagnosis_report(diagnosis(held=prediction("x"))))) < 2e6


def test_what_the_disturbance_takes_stands_beside_each_degree_of_freedom():
    of_surge = Disturbance("surge", 3.1, 0.62, True)
    page = read(diagnosis(gap=replace(diagnosis().gap, disturbance=(of_surge,))))
    assert "surge\n2.4 N\n3.1 N, 62 %\n34 → 12 mm/s" in page
    assert "Disturbance: the fitted stationary disturbance" in page
    assert "Disturbance" not in read(diagnosis())


def test_the_values_can_be_stretched_as_the_times_can_and_their_labels_go_along():
    html = render(traces(), "a")
    assert re.findall(r'<input type="radio" class="(\w+)"', html) == [
        "zoom1",
        "zoom4",
        "zoom16",
        "high1",
        "high4",
    ]
    assert len(re.findall(r'name="a"', html)) == 3
    assert len(re.findall(r'name="a-h"', html)) == 2
    tops = re.findall(r"top:calc\(([\d.]+)\*var\(--high\)\)", html)
    assert len(tops) > 3
    assert all(0.0 <= float(top) <= 1.0 for top in tops)


def test_before_and_after_are_drawn_in_the_same_colours_as_in_the_other_figures_of_the_page():
    strokes = re.findall(r"\.curve\d \{ stroke: var\(--(\w+)\)", STYLE)
    traced = {label: LIGHT[name] for label, name in zip(FLOWN, strokes, strict=True)}
    drawn = {label: STYLES[style]["color"] for label, style in STYLE_OF.items()}
    assert {label: traced[label] for label in drawn.keys() & traced.keys()} == {
        "before": drawn["before"],
        "after": drawn["after"],
    }


def test_a_phone_shows_every_other_time_so_that_none_covers_the_next():
    times = re.findall(
        r"<span( class=\"\w+\")? style=\"left:[\d.]+%\">(\d+) s", render(traces(n=17_500), "a")
    )
    at_once = [(kind, seconds) for kind, seconds in times if kind in ("", ' class="between"')]
    assert at_once == [("" if k % 2 == 0 else ' class="between"', str(100 * k)) for k in range(7)]
    assert ".zoom1:checked ~ .pane .between { display: none; }" in STYLE
