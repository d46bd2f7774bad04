"""The page of a diagnosis: every answer has its place, its unit and its words, and a picture that can be read."""

import re

import pytest
from made_diagnoses import NAN, Text, diagnosis, effect, gap, page_of, read

from identify.diagnose import wording, wording_verdict
from identify.diagnose.result import Gap, Next, Shrink, Tried
from identify.report.diagnosis import diagnosis_page, diagnosis_report

pytestmark = pytest.mark.usefixtures("sketched")


def test_where_there_is_no_gap_the_page_shows_no_shares_of_it_and_no_empty_picture():
    weak = (Tried(effect("waves"), 1.9, False), Tried(effect("dvl_bias"), 0.0, False))
    quiet = diagnosis(verdict="no_gap", gap=gap(1.02, 1.02), findings=(), tried=weak, check=None)
    page = read(quiet)
    assert "There is no gap, so it lies nowhere" in page
    assert "What the missing force goes with" not in page
    assert "Missing" not in page
    assert "surge\n1.0\n1.0\n1.0" in page
    assert "Here none of 2 candidates saves more than 2 nats." in page
    names = {figure.name for part in diagnosis_report(quiet).sections for figure in part.figures}
    assert names == {"drift over the dive", "drift by horizon"}
    assert "There is no gap, so it lies nowhere" not in read(diagnosis())


def test_a_table_of_many_columns_breaks_its_headings_before_it_leaves_the_page():
    assert ".scroll thead th { white-space: normal; }" in page_of(diagnosis())


def test_the_drift_of_the_whole_dive_stands_beside_those_that_the_verdict_tells_of():
    assert wording_verdict.shrink_lines(diagnosis(check=None))[0] == (
        "Over the whole dive, which was fitted: the 5 s drift goes from 3.4 floors to 0.85 floors."
    )
    page = read(diagnosis())
    assert "fitted: the whole dive\n3.40\n0.849" in page
    assert "a dive without any gap comes to 0.8 to 1.2" in page


def test_the_page_stands_alone_and_runs_nothing():
    page = Text(page_of(diagnosis()))
    tags = {tag for tag, _ in page.attributes}
    assert not {"script", "link", "img", "iframe", "object", "form"} & tags
    assert not [
        a
        for _, a in page.attributes
        for key, value in a.items()
        if "http" in (value or "") and key != "xmlns"
    ]


def test_the_parts_come_in_the_order_in_which_a_crew_asks():
    html = diagnosis_page(diagnosis(next=Next(("a coast-down",), (), ("quadratic_drag", "inflow_loss"))))
    assert re.findall(r"<h2>(.*?)</h2>", html) == [
        "1. Where it lies",
        "1.1 How large it is",
        "1.2 What it goes with",
        "2. What causes it",
        "2.1 All candidates",
        "3. How far it shrinks",
        "What to dive next",
        "Notes",
    ]
    assert html.index("explains the gap") < html.index("<h2>")


def test_an_interval_of_nothing_but_one_number_is_left_out():
    assert wording.percents(0.84, 0.94) == "84 % to 94 %"
    assert wording.percents(-0.001, 0.004) == wording.percents(NAN, 0.4) == ""
    none = Shrink(1.5, 1.5, 0.0, 0.0, 0.0)
    assert wording_verdict.shrink_lines(diagnosis(check=None, heldout=none))[1:] == (
        "On pieces held out: the 5 s drift goes from 1.5 floors to 1.5 floors, 0 % of what can be closed.",
    )
    assert "1.50\n1.50\n0 %\n—" in read(diagnosis(heldout=none))


def test_the_drift_stands_before_and_after_by_degree_of_freedom():
    page = read(diagnosis())
    assert "surge\n83 %\n2.4 N\n3.4 → 1.2\n3.4 → 1.2\n3.4 → 1.2" in page
    assert "yaw\n2 %\n0.12 N m\n1.7 → 0.6" in page


def test_predicted_and_measured_shrink_stand_side_by_side():
    page = read(diagnosis())
    assert "predicted: pieces held out\n3.40\n1.25\n90 %\n84 % to 94 %" in page
    assert "measured: the check dive\n3.10\n1.30\n86 %\n79 % to 92 %" in page
    assert "What was predicted and what was measured are 4 points apart." in page
    near = diagnosis(heldout=Shrink(3.0, 1.0, 0.99, NAN, NAN), check=Shrink(3.0, 1.0, 0.98, NAN, NAN))
    assert "are 1 point apart." in read(near)


def test_a_diagnosis_of_nothing_at_all_is_still_a_page():
    empty = Gap(NAN, (), (), {}, (), (), ())
    bare = diagnosis(
        verdict="no_gap", gap=empty, findings=(), tried=(), heldout=None, check=None, next=None, notes=()
    )
    page = read(bare)
    assert "No degree of freedom could be compared with the model." in page
    assert "nan" not in page
