"""The causes and candidates of a diagnosis: each named once, with its units, what it saves and what speaks against."""

import math
from dataclasses import replace

import numpy as np
import pytest
from made_diagnoses import LIBRARY, NAN, Text, diagnosis, effect, found, places, read

from identify.diagnose import wording
from identify.diagnose.candidates import Cause
from identify.diagnose.result import Finding, Gain, Next, Tried, Value
from identify.effects.sensors import WRONG_FEEDBACK_LOG
from identify.report.diagnosis import diagnosis_page, diagnosis_report
from identify.report.picture import WIDE_IN

pytestmark = pytest.mark.usefixtures("sketched")


def test_a_cause_that_no_nats_speak_for_is_said_to_rest_on_another_test():
    heard = Finding(Cause(WRONG_FEEDBACK_LOG, np.zeros(0)), (), {}, 0.9, {}, 0.0)
    assert "rests on another test" in read(diagnosis(findings=(heard,)))
    assert "rests on another test" not in read(diagnosis())


def test_parameters_have_units_and_intervals_that_a_crew_reads():
    assert (
        wording.value_words("X_uu", Value(12.34, "N s2/m2", 10.1, 14.5))
        == "X_uu 12.3 N s²/m² (95 %: 10.1 to 14.5)"
    )
    assert wording.value_words("yaw", Value(0.0349, "rad", NAN, NAN)) == "yaw 0.03490 rad, 2.0°"
    assert wording.value_words("rate", Value(2e-4, "1/s", NAN, NAN)).endswith("1/s, 1.2 % a minute")
    assert (
        wording.value_words("low_end_loss", Value(0.2, "1", 0.1, 0.3))
        == "low end loss 0.20 (95 %: 0.10 to 0.30)"
    )


def test_no_cause_is_ever_told_as_certain():
    assert wording.percent_sure(1.0) == "over 99 %"
    assert wording.percent_sure(0.0) == "under 1 %"
    assert wording.percent_sure(0.87) == "87 %"


@pytest.mark.usefixtures("rendered")
def test_every_candidate_stands_once_in_its_best_form_and_the_accepted_one_is_marked():
    page = Text(diagnosis_page(diagnosis()))
    names = [line for line in page.lines if line.startswith(("munk moment", "quadratic drag"))]
    assert sum(line.startswith("munk moment (") for line in names) == 1
    assert [line for line in page.lines if line.endswith(": accepted")] == ["quadratic drag: accepted"]
    assert page.lines[page.lines.index("quadratic drag: accepted") + 1] == "61 nats"
    (figure,) = [
        f for part in diagnosis_report(diagnosis()).sections for f in part.figures if f.name == "candidates"
    ]
    widths = [bar.get_width() for bar in figure.draw(WIDE_IN).axes[0].patches]
    assert widths[:2] == pytest.approx([1.0, math.log1p(4.8) / math.log1p(61.2)])
    named = {(one.name, one.number): one.label for one in LIBRARY}
    told = {key for key in named if any(5.0 - 0.2 * k > 2.0 for k in places(key))} | {("quadratic_drag", 0)}
    shown = sum("nats" in line and line[0].isdigit() and "others" not in line for line in page.lines)
    assert shown == len(told)
    (caption,) = [line for line in page.lines if line.startswith("What each candidate saves")]
    assert caption.endswith(f" {len(named) - len(told)} others: none gains more than 2 nats.")
    assert any("2.7 times as likely" in line for line in page.lines)


@pytest.mark.usefixtures("rendered")
def test_a_candidate_that_is_less_probable_than_not_is_possible_and_not_accepted():
    drag = replace(found("quadratic_drag"), probability=0.42)
    page = Text(diagnosis_page(diagnosis(findings=(drag,))))
    assert page.lines[page.lines.index("quadratic drag (possible: 42 % probable)") + 1] == "61 nats"
    assert not [line for line in page.lines if line.endswith(": accepted")]
    half = replace(drag, probability=0.5)
    assert "quadratic drag: accepted" in Text(diagnosis_page(diagnosis(findings=(half,)))).lines


@pytest.mark.usefixtures("rendered")
def test_a_candidate_that_would_save_enough_and_was_not_accepted_says_why():
    why = Tried(
        replace(effect("waves"), variant="2.25 and 2.33 s"),
        20.0,
        False,
        "too little here: 30 nats are asked for",
    )
    page = read(diagnosis(tried=(*diagnosis().tried, why)))
    assert "waves (2.25 and 2.33 s) (too little here: 30 nats are asked for)\n20 nats" in page


def test_one_thruster_is_named_once_with_its_number():
    assert wording.candidate_words(effect("weak_thruster", 8)) == "weak thruster 8"
    turned = effect("thruster_misalignment", 2)
    assert wording.candidate_words(turned).startswith("thruster misalignment (thruster 2)")
    assert wording.effect_words(effect("weak_thruster", 8)) == "weak thruster 8"


def test_the_feed_forward_s_gain_is_told_in_millimetres_a_second_and_where_there_is_none_why():
    gained = diagnosis(
        findings=(found("quadratic_drag", feedforward=Gain(0.0234, 0.0051)), found("dvl_bias"))
    )
    page = read(gained)
    assert "quadratic drag\n23 mm/s\n5.1 mm/s\nquadratic drag" in page
    assert "DVL bias\n—\n—\nnothing: the feed-forward can't" in page
    assert wording.gain_lines(gained) == (
        "Quadratic drag: the feed-forward alone would track to 5.1 mm/s instead of 23 mm/s (typical velocity error).",
    )


def test_what_to_dive_next_says_what_it_splits():
    said = diagnosis(next=Next(("a coast-down",), ("shaft speeds",), ("thruster_lag", "command_delay")))
    assert wording.next_lines(said) == (
        "Dive next: a coast-down. It splits thruster lag and command delay.",
        "Record as well: shaft speeds.",
    )
    assert "Record as well: shaft speeds." in read(said)
