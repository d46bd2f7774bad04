"""Curves over time: zoomed by buttons without any script, thin enough for a page that is mailed."""

import re
from dataclasses import replace

import numpy as np
import pytest
from made_diagnoses import Text, diagnosis, prediction, read

from identify.diagnose.result import AxisShrink, Disturbance, Shrink
from identify.report.diagnosis import diagnosis_report
from identify.report.page import render_report
from identify.report.traces import Traces, render

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


def test_buttons_stretch_the_time_axis_and_only_one_is_pressed():
    page = Text(render(traces(), "a"))
    buttons = [a for tag, a in page.attributes if tag == "input"]
    assert [one["class"] for one in buttons] == ["zoom1", "zoom4", "zoom16"]
    assert ["checked" in one for one in buttons] == [True, False, False]
    assert len({one["id"] for one in buttons}) == 3
    assert {"whole", "4 times", "16 times", "measured", "before", "after", "10 s"} <= set(page.lines)


def test_the_further_it_is_zoomed_the_more_times_are_told_and_none_twice():
    html = render(traces(), "a")
    at = re.findall(r'<span(?: class="(at\d+)")? style="left:([\d.]+)%">', html)
    places = [place for _, place in at]
    assert len(places) == len(set(places))
    assert 0 < sum(not kind for kind, _ in at) < sum(kind == "at16" for kind, _ in at)


def test_an_hour_in_six_degrees_of_freedom_stays_below_a_megabyte():
    long = traces(90_000, 6)
    html = render(replace(long, block=np.arange(90_000) // 90_000), "a")
    assert len(html) < 1e6
    assert html.count(" ") < 6 * 3 * 2.5 * 3000
    still = replace(traces(), panels=(("heave, m/s", np.zeros((3, 500))),))
    assert "nan" not in render(still, "a")


def test_the_page_shows_measured_beside_simulated_on_the_check_dive_or_else_held_out():
    page = read(diagnosis(prediction=prediction("lap-4"), held=prediction("pieces held out")))
    assert "3.1 Measured and simulated" in page
    assert "On the check dive, lap-4." in page
    assert "yaw, °/s" in page
    held = read(diagnosis(held=prediction("pieces held out")))
    assert "On pieces held out of the fit." in held
    assert "3.1 Measured" not in read(diagnosis())
    assert len(render_report(diagnosis_report(diagnosis(held=prediction("x"))))) < 2e6


def test_each_degree_of_freedom_is_told_in_absolute_terms_before_all_together():
    surge = AxisShrink("surge", 0.034, 0.016, 0.009, 0.72, 0.61, 0.28, 0.33)
    yaw = AxisShrink("yaw", 0.02, 0.02, 0.019, float("nan"), 0.4, 0.4, 0.9)
    check = Shrink(3.1, 1.3, 0.857, 0.79, 0.92, by_axis=(surge, yaw))
    page = read(diagnosis(check=check))
    assert "surge\n34 mm/s\n16 mm/s\n9.0 mm/s\n72 %\n0.61 → 0.28\n0.628 → 0.922\n0.33" in page
    assert "yaw\n1.1 °/s\n1.1 °/s\n1.1 °/s\n—\n0.40 → 0.40" in page
    assert page.index("The check dive. Each degree of freedom") < page.index("All together")


def test_what_the_disturbance_takes_stands_beside_each_degree_of_freedom():
    of_surge = Disturbance("surge", 3.1, 0.62, True)
    page = read(diagnosis(gap=replace(diagnosis().gap, disturbance=(of_surge,))))
    assert "surge\n83 %\n2.4 N\n3.1 N, 62 %\n3.4 → 1.2" in page
    assert "Disturbance: the fitted stationary disturbance" in page
    assert "Disturbance" not in read(diagnosis())
