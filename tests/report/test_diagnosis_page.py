"""The page of a diagnosis: verdict, causes, candidates, place of the gap, pictures."""

import math
import re
from dataclasses import replace

import numpy as np
import pytest
from made_diagnoses import (
    LIBRARY,
    NAN,
    UNKNOWN,
    diagnosis,
    effect,
    finding_of,
    gap,
    places,
    read,
    shrink,
    with_figure,
)

from identify.checks.actuation.thrust_response import mounted_otherwise
from identify.diagnose.causes.candidates import Cause
from identify.diagnose.result import (
    AxisShrink,
    Dependence,
    Disturbance,
    Finding,
    Gain,
    Gap,
    Share,
    Shrink,
    Slice,
    Tried,
    Value,
)
from identify.diagnose.words import causes as cause_words
from identify.diagnose.words import diagnosis as wording
from identify.diagnose.words import drift as drift_words
from identify.diagnose.words import gap as gap_words
from identify.effects.sensors import WRONG_FEEDBACK_LOG
from identify.report.diagnosis import diagnosis_report

pytestmark = pytest.mark.usefixtures("sketched")


def test_where_there_is_no_gap_the_page_shows_no_shares_of_it_and_no_empty_picture():
    weak = (Tried(effect("waves"), 1.9, False), Tried(effect("dvl_bias"), 0.0, False))
    quiet = diagnosis(verdict="no_gap", gap=gap(1.02, 1.02), findings=(), tried=weak, check=None)
    page = read(quiet)
    assert "There is no gap, so it lies nowhere" in page
    assert "What the missing force goes with" not in page
    assert "Missing" not in page
    assert "surge\n10 mm/s\n23 mm/s\n46 mm/s" in page
    assert "Here none of 2 candidates saves more than 2 nats." in page
    names = {figure.name for part in diagnosis_report(quiet).sections for figure in part.figures}
    assert names == {"drift over the dive", "drift by horizon"}
    assert "There is no gap, so it lies nowhere" not in read(diagnosis())


def test_a_page_without_a_gap_shows_no_bars_and_no_share_of_a_drift_that_is_not_there():
    tried = (Tried(effect("waves"), 9.7, False), Tried(effect("dvl_bias"), 0.0, False))
    quiet = diagnosis(
        verdict="no_gap", gap=gap(1.02, 1.02), findings=(), heldout=NOTHING, tried=tried, check=None
    )
    page = read(quiet)
    assert re.search(r"Candidate\nSaves\nwaves.*\n9.7 nats\n", page)
    assert "Closes\n95 % interval" not in page
    drawn = [figure.name for part in diagnosis_report(quiet).sections for figure in part.figures]
    assert "candidates" not in drawn
    with_gap = diagnosis_report(diagnosis(tried=tried)).sections
    assert "candidates" in [figure.name for part in with_gap for figure in part.figures]


def test_the_drift_of_the_fitted_dive_is_told_apart_from_that_of_dives_and_pieces_that_were_not_fitted():
    fitted = (
        "drift of the simulated velocity without → with the causes, over the whole dive, which was fitted."
    )
    assert fitted in read(diagnosis())
    assert "over the whole dive, which was fitted" in read(replace(diagnosis(), verdict="no_gap"))


def test_an_interval_of_nothing_but_one_number_is_left_out():
    assert cause_words.percents(0.84, 0.94) == "84 % to 94 %"
    assert cause_words.percents(-0.001, 0.004) == cause_words.percents(NAN, 0.4) == ""
    none = shrink(1.5, 1.5, 0.0, 0.0, 0.0)
    assert wording.shrink_lines(diagnosis(check=None, heldout=none))[-1] == (
        "On pieces held out, all together: the model with the causes closes 0 % of the 5 s drift beyond noise."
    )
    assert "predicted: pieces held out\n0 %\n—" in read(diagnosis(heldout=none))


def test_predicted_and_measured_shrink_stand_side_by_side():
    page = read(diagnosis())
    assert "0.8 to 1.2 times as much is as good as a model gets" in page
    assert wording.shrink_lines(diagnosis(check=None))[0] == (
        "Over the whole dive, which was fitted: the 5 s drift falls from 76 mm/s to 27 mm/s in surge and from 1.1 "
        "deg/s to 0.38 deg/s in yaw."
    )
    assert "predicted: pieces held out\n90 %\n84 to 94 %" in page
    assert "measured: the check dive\n86 %\n79 to 92 %" in page
    assert "What was predicted and what was measured are 4 points apart." in page
    near = diagnosis(heldout=shrink(3.0, 1.0, 0.99), check=shrink(3.0, 1.0, 0.98))
    assert "are 1 point apart." in read(near)


def test_a_diagnosis_of_nothing_at_all_is_still_a_page():
    empty = Gap(NAN, (), (), {}, (), (), ())
    bare = diagnosis(
        verdict="no_gap", gap=empty, findings=(), tried=(), heldout=None, check=None, next=None, notes=()
    )
    page = read(bare)
    assert "No degree of freedom could be compared with the model." in page
    assert "nan" not in page


NOTHING = shrink(1.02, 1.01, NAN)
BY_CHANCE = "no more than noise makes it by chance"
PLACE = " Most of it lies in surge, steady, mostly above 0.30 m/s."


def test_the_verdict_says_cause_place_speed_and_what_the_drift_falls_to():
    said = wording.verdict_sentence(diagnosis(check=None, heldout=None))
    assert said == (
        "Quadratic drag explains the gap: with it the model's 5 s drift falls from 76 mm/s to 27 mm/s in surge and "
        f"from 1.1 deg/s to 0.38 deg/s in yaw, which closes 100 % of what is beyond noise, all together.{PLACE}"
    )
    two = diagnosis(findings=(finding_of("quadratic_drag"), finding_of("weak_thruster", 3)))
    assert wording.verdict_sentence(two).startswith("Quadratic drag and weak thruster 3 explain the gap: ")


@pytest.mark.parametrize(
    ("other", "ending"),
    [
        (
            {},
            "falls from 31 mm/s to 13 mm/s in surge and from 0.93 deg/s to 0.39 deg/s in yaw on the check dive, which "
            "closes 86 % of what is beyond noise, all together.",
        ),
        (
            {"check": None},
            "falls from 1.0 deg/s to 0.38 deg/s in yaw and from 34 mm/s to 12 mm/s in surge on pieces held out, which "
            "closes 90 % of what is beyond noise, all together.",
        ),
        (
            {"check": shrink(3.0, 3.5, -0.25)},
            "goes from 30 mm/s to 35 mm/s in surge and from 0.90 deg/s to 1.0 deg/s in yaw on the check dive, which "
            "closes −25 % of what is beyond noise, all together.",
        ),
    ],
)
def test_the_verdict_speaks_of_the_best_evidence_there_is(other, ending):
    assert wording.verdict_sentence(diagnosis(**other)).endswith(ending + PLACE)


def test_the_share_in_the_headline_is_that_of_all_degrees_of_freedom_which_need_not_be_that_of_those_it_names():
    shrunk = shrink(3.0, 1.0, 0.98)
    each = tuple(replace(axis, value=0.89) for axis in shrunk.by_axis)
    told = diagnosis(check=None, heldout=replace(shrunk, by_axis=each))
    assert "closes 98 % of what is beyond noise, all together." in wording.verdict_sentence(told)
    lines = wording.shrink_lines(told)
    assert lines[-1].startswith("On pieces held out, all together: the model with the causes closes 98 % ")
    assert sum("closes 89 % of what is beyond noise." in line for line in lines) == len(each)


def test_a_check_dive_that_does_not_bear_the_cause_out_is_told_in_the_headline():
    unborne = diagnosis(heldout=shrink(3.0, 1.0, 0.98, 0.95, 1.0), check=shrink(3.0, 2.8, 0.11, 0.0, 0.2))
    but = "but the check dive does not bear that out (98 % of the drift beyond noise was foretold to close there, and "
    assert but in wording.verdict_sentence(unborne)
    assert but in wording.verdict_sentence(replace(unborne, verdict="unknown"))


@pytest.mark.parametrize("share", [math.nan, -0.5])
def test_where_the_check_dive_shows_no_such_effect_that_is_said_and_the_drift_is_that_of_pieces_held_out(
    share,
):
    sound = shrink(1.1, 3.1, share, share - 0.2, share + 0.2)
    told = wording.verdict_sentence(diagnosis(heldout=shrink(3.0, 1.0, 0.98, 0.95, 1.0), check=sound))
    assert told.startswith(
        "Quadratic drag explains the gap, but the check dive shows no such effect (its 5 s drift is 1.1 times what "
        "noise makes it without the causes, and 3.1 times with them): with it the model's 5 s drift falls from "
    )
    assert "on pieces held out, which closes 98 % of what is beyond noise, all together" in told


def test_causes_that_can_not_be_told_apart_are_named_together():
    lag = finding_of("thruster_lag", also=("command_delay",), likeness={"command_delay": 0.97})
    unclear = diagnosis(verdict="ambiguous", findings=(lag,))
    assert wording.verdict_sentence(unclear).startswith(
        "Thruster lag or command delay explains the gap, but this dive can't tell thruster lag from command delay: "
    )
    unborne = replace(
        unclear, heldout=shrink(3.0, 1.0, 0.98, 0.95, 1.0), check=shrink(1.1, 3.1, NAN, NAN, NAN)
    )
    assert "from command delay, and the check dive shows no such effect (" in wording.verdict_sentence(
        unborne
    )
    current = finding_of("steady_current", also=("thrust_bias",), likeness={"thrust_bias": 0.97})
    both = wording.verdict_sentence(diagnosis(verdict="ambiguous", findings=(lag, current)))
    assert "can't tell thruster lag from command delay and steady current from thrust bias: " in both
    (line,) = wording.cause_lines(unclear)
    sentence = (
        "This dive can't tell it from command delay (likeness 0.97); what would: shaft speeds, and fast steps in a "
        "log of 50 Hz."
    )
    assert line.endswith(sentence)
    assert f"{sentence}\nLikeness: at 1 no method could tell" in read(unclear)


@pytest.mark.parametrize(
    ("north", "east", "towards"),
    [
        (-0.105, 0.179, "0.21 m/s towards 120°"),
        (0.3, -0.001, "0.30 m/s towards 0°"),
        (0.0, -0.5, "0.50 m/s towards 270°"),
    ],
)
def test_a_current_has_its_speed_and_the_way_that_it_goes(north, east, towards):
    parameters = {way: Value(size, "m/s", NAN, NAN) for way, size in (("north", north), ("east", east))}
    (line,) = wording.cause_lines(diagnosis(findings=(finding_of("steady_current", parameters=parameters),)))
    assert line.endswith(f"m/s; that is {towards}.")
    assert "that is" not in wording.cause_lines(diagnosis())[0]


def test_a_dive_without_a_gap_is_told_so_and_names_no_cause():
    quiet = diagnosis(verdict="no_gap", gap=gap(1.02, 1.02), findings=(), heldout=NOTHING, check=None)
    assert wording.verdict_sentence(quiet) == (
        "No gap: the model's 5 s drift is 23 mm/s in surge (noise alone 22 mm/s) and 14 mm/s in sway (noise alone 27 "
        f"mm/s), {BY_CHANCE}, and no candidate explains any of it."
    )
    assert wording.cause_lines(quiet) == ()
    assert wording.shrink_lines(quiet)[-1] == (
        "On pieces held out, all together: there is too little drift beyond noise to close."
    )
    assert "No candidate of the library explains anything that noise would not." in read(quiet)


def test_a_drift_beyond_chance_that_nothing_explains_is_never_called_no_gap():
    drifting = diagnosis(verdict="no_gap", gap=gap(3.0, 3.0), findings=(), heldout=NOTHING, check=None)
    assert wording.verdict_sentence(drifting) == (
        "Nothing that lasts: the model's 5 s drift is 67 mm/s in surge (noise alone 22 mm/s) and 0.96 deg/s in yaw "
        "(noise alone 0.64 deg/s), but neither a candidate nor any force that returns explains it."
    )
    page = read(drifting)
    assert "There is no gap" not in page
    assert "fly the same again to see whether it lasts" in page


def test_what_no_candidate_explains_is_described():
    unknown = diagnosis(verdict="unknown", character=UNKNOWN)
    assert wording.verdict_sentence(unknown) == (
        "Something is there that no candidate explains: all of it lies in yaw, at rest; it is fixed to the world, "
        "even in speed, intermittent, and goes with heading and yaw rate. Quadratic drag explains part of the gap."
    )
    elsewhere = replace(unknown, character=replace(UNKNOWN, dof=("sway", "roll")))
    without = replace(elsewhere, gap=replace(gap(), where=(Share("surge", "steady", 1.0),)))
    assert "explains: it lies in sway and roll; it is fixed" in wording.verdict_sentence(without)
    left = replace(gap(), unexplained_where=(Share("yaw", "turning", 1.0),))
    assert "explains: all of it lies in yaw, turning; " in wording.verdict_sentence(
        replace(unknown, gap=left)
    )
    page = read(unknown)
    assert "What no candidate explains: It acts in yaw. It is fixed to the world." in page
    assert "It goes with heading and yaw rate." in page


def test_a_cause_less_probable_than_not_is_told_as_possible():
    bias = finding_of("thrust_bias", probability=0.42)
    sentence = wording.verdict_sentence(diagnosis(findings=(finding_of("quadratic_drag"), bias)))
    assert sentence.startswith(
        "Quadratic drag explains the gap; thrust bias (42 % probable) may explain some of it, too: with them "
    )
    alone = wording.verdict_sentence(diagnosis(findings=(bias,)))
    assert alone.startswith("Thrust bias (42 % probable) may explain the gap: ")
    unknown = wording.verdict_sentence(diagnosis(verdict="unknown", findings=(bias,)))
    assert unknown.endswith("Thrust bias (42 % probable) may explain part of the gap.")


def test_a_cause_with_which_the_drift_does_not_shrink_explains_no_part_of_the_gap():
    grown = diagnosis(verdict="unknown", character=UNKNOWN, heldout=Shrink(2.0, 2.3, -0.3, -0.9, -0.1))
    assert wording.verdict_sentence(grown).endswith(
        " It looks like quadratic drag, but with it the drift does not shrink on pieces held out."
    )


def test_what_is_recorded_and_not_the_motion_is_never_said_to_make_the_drift_fall():
    heard = Finding(Cause(WRONG_FEEDBACK_LOG, np.zeros(0)), (), {}, 0.9, {}, 0.0)
    assert "rests on another test" in read(diagnosis(findings=(heard,)))
    said = wording.verdict_sentence(diagnosis(findings=(heard,), heldout=shrink(0.99, 0.99, NAN), check=None))
    assert said.endswith(
        "it shows in what is recorded, not in the motion: with it or without, the model's 5 s drift is 9.9 mm/s in "
        "surge (noise alone 10 mm/s) and 0.30 deg/s in yaw (noise alone 0.30 deg/s) on pieces held out, "
        f"{BY_CHANCE}.{PLACE}"
    )


def test_a_cause_that_makes_no_drift_is_said_to_open_no_gap():
    lag = replace(finding_of("thruster_lag"), probability=0.89)
    small = replace(gap(), before=1.02)
    said = wording.verdict_sentence(
        diagnosis(findings=(lag,), gap=small, heldout=shrink(0.96, 0.96, NAN), check=None)
    )
    assert said.startswith("Thruster lag shows, but opens no gap: ")
    assert said.endswith(" Most of what shows lies in surge, steady, mostly above 0.30 m/s.")
    chance = wording.verdict_sentence(
        diagnosis(findings=(lag,), gap=small, heldout=shrink(0.98, 0.91, NAN), check=None)
    )
    assert chance.startswith("Thruster lag shows, but opens no gap: ")
    assert (
        ": without it the model's 5 s drift is 9.8 mm/s in surge (noise alone 10 mm/s) and 0.29 deg/s in yaw (noise "
        "alone 0.30 deg/s), with it 9.1 mm/s in surge (noise alone 10 mm/s) and 0.27 deg/s in yaw (noise alone 0.30 "
        f"deg/s) on pieces held out, {BY_CHANCE}." in chance
    )
    closes = diagnosis(findings=(lag,), gap=small, heldout=shrink(1.15, 1.0, 0.9), check=None)
    assert wording.verdict_sentence(closes).startswith("Thruster lag explains the gap: ")
    wide = wording.verdict_sentence(diagnosis(findings=(lag,), heldout=shrink(0.96, 0.96, NAN), check=None))
    assert wide.startswith("Thruster lag explains the gap: ")


def test_what_nothing_can_be_relied_on_for_comes_before_the_cause():
    first = mounted_otherwise((0,), ())
    said = wording.verdict_sentence(diagnosis(first=first, provisos=("Heave was not judged.",)))
    assert said.startswith(
        "The recorded motion does not go the way the thrust pushes, and no cause can be relied on until that is "
        "mended. In surge the recorded velocity runs against the thrust: "
    )
    assert said.index("Quadratic drag explains") > said.index("check both")
    assert said.endswith(" Heave was not judged.")
    assert mounted_otherwise((), ()) == ()


def test_what_is_borne_out_in_part_is_named_and_the_rest_told_beside_it_with_its_share():
    partly = replace(gap(), unexplained_where=(Share("yaw", "turning", 1.0),), unexplained=0.38)
    said = wording.verdict_sentence(diagnosis(verdict="partly", gap=partly, character=UNKNOWN))
    assert said.startswith(
        "Quadratic drag explains part of the gap: with it the model's 5 s drift falls from 31 mm/s"
    )
    assert (
        f"{PLACE} Something is left that no candidate explains, 38 % of the drift beyond noise on pieces"
        in said
    )
    assert "held out: all of that lies in yaw, turning" in said
    assert "38 %" not in wording.verdict_sentence(
        diagnosis(verdict="partly", gap=replace(partly, unexplained=NAN), character=UNKNOWN)
    )


def test_a_disturbance_that_takes_a_third_is_told_in_newtons_in_per_cent_and_with_what_it_may_be():
    taken = (Disturbance("surge", 3.1, 0.62, True), Disturbance("sway", 0.2, 1.0, False))
    said = wording.verdict_sentence(
        diagnosis(verdict="unknown", findings=(), gap=replace(gap(), disturbance=taken))
    )
    assert "in surge it takes 3.1 N, 62 % of the variance of the thrusters' force." in said
    assert "a tether, or thrust that the vehicle file or the recording has wrong" in said
    assert "sway" not in said
    (line,) = gap_words.disturbance_line(taken)
    assert "in surge 3.1 N (62 %) and in sway 0.20 N (over 99 %, only held)" in line
    assert "More than a third is much" in line
    assert gap_words.disturbance_line(()) == ()


SURGE = AxisShrink("surge", 0.034, 0.016, 0.009, 0.72, 0.61, 0.28, 0.33)
YAW = AxisShrink("yaw", 0.02, 0.018, 0.017, 0.5, 0.4, 0.3, 0.9)


def test_the_verdict_and_its_lines_tell_the_drift_in_absolute_terms_by_degree_of_freedom():
    borne = diagnosis(check=Shrink(3.1, 1.3, 0.857, 0.79, 0.92, by_axis=(SURGE, YAW)), heldout=None)
    assert wording.verdict_sentence(borne).endswith(
        "with it the model's 5 s drift falls from 34 mm/s to 16 mm/s in surge "
        f"on the check dive, which closes 86 % of what is beyond noise, all together.{PLACE}"
    )
    _, surge, yaw, pooled = wording.shrink_lines(borne)
    assert surge == (
        "On the check dive, surge: the 5 s drift goes from 34 mm/s to 16 mm/s (noise alone 9.0 mm/s); closes 72 % of "
        "what is beyond noise."
    )
    assert yaw.startswith("On the check dive, yaw: the 5 s drift goes from 1.1 deg/s to 1.0 deg/s")
    assert pooled == (
        "On the check dive, all together: the model with the causes closes 86 % (95 %: 79 % to 92 %) of the 5 s drift "
        "beyond noise."
    )
    sway, heave = (
        replace(SURGE, dof="sway", after=0.02),
        replace(SURGE, dof="heave", before=0.01, after=0.001, floor=0.001),
    )
    turned = replace(YAW, after=0.009)
    assert drift_words.changes((sway, SURGE)).endswith("from 34 mm/s to 20 mm/s in sway")
    assert drift_words.changes((sway, SURGE, heave, turned)).endswith(
        "in surge and from 34 mm/s to 20 mm/s in sway"
    )
    assert drift_words.changes((sway, SURGE, replace(YAW, after=0.003))).endswith(
        "from 1.1 deg/s to 0.17 deg/s in yaw"
    )
    worse, same = replace(YAW, after=0.03), replace(YAW, value=NAN)
    assert drift_words.changes((worse, SURGE)).startswith("goes ")
    assert drift_words.changes((same,)) == ""


def test_parameters_have_units_and_intervals_that_a_crew_reads_and_no_cause_is_certain():
    assert (
        cause_words.value_words("X_uu", Value(12.34, "N s2/m2", 10.1, 14.5))
        == "X_uu 12.3 N s²/m² (95 %: 10.1 to 14.5)"
    )
    assert cause_words.value_words("yaw", Value(0.0349, "rad", NAN, NAN)) == "yaw 0.03490 rad, 2.0°"
    assert cause_words.value_words("rate", Value(2e-4, "1/s", NAN, NAN)).endswith("1/s, 1.2 % a minute")
    assert (
        cause_words.value_words("low_end_loss", Value(0.2, "1", 0.1, 0.3))
        == "low end loss 0.20 (95 %: 0.10 to 0.30)"
    )
    assert [cause_words.percent_bounded(p) for p in (1.0, 0.0, 0.87)] == ["over 99 %", "under 1 %", "87 %"]
    assert cause_words.candidate_words(effect("weak_thruster", 8)) == "weak thruster 8"
    assert cause_words.candidate_words(effect("thruster_misalignment", 2)).startswith(
        "thruster misalignment (thruster 2)"
    )


@pytest.mark.usefixtures("rendered")
def test_every_candidate_stands_once_in_its_best_form_and_the_accepted_one_is_marked():
    page = with_figure(diagnosis(), "candidates")
    names = [line for line in page.lines if line.startswith(("munk moment", "quadratic drag"))]
    assert sum(line.startswith("munk moment (") for line in names) == 1
    assert [line for line in page.lines if line.endswith(": accepted")] == ["quadratic drag: accepted"]
    assert page.lines[page.lines.index("quadratic drag: accepted") + 1] == "61 nats"
    (figure,) = [
        f for part in diagnosis_report(diagnosis()).sections for f in part.figures if f.name == "candidates"
    ]
    widths = [bar.get_width() for bar in figure.draw(10.0).axes[0].patches]
    assert widths[:2] == pytest.approx([1.0, math.log1p(4.8) / math.log1p(61.2)])
    named = {(item.name, item.number): item.label for item in LIBRARY}
    gaining = {key for key in named if any(5.0 - 0.2 * k > 2.0 for k in places(key))} | {
        ("quadratic_drag", 0)
    }
    shown = sum("nats" in line and line[0].isdigit() and "others" not in line for line in page.lines)
    assert shown == len(gaining)
    (caption,) = [line for line in page.lines if line.startswith("What each candidate saves")]
    assert caption.endswith(f" {len(named) - len(gaining)} others: none gains more than 2 nats.")
    assert any("2.7 times as likely" in line for line in page.lines)


@pytest.mark.usefixtures("rendered")
def test_a_candidate_that_is_possible_or_was_not_accepted_says_so_and_why():
    drag = replace(finding_of("quadratic_drag"), probability=0.42)
    page = with_figure(diagnosis(findings=(drag,)), "candidates")
    assert page.lines[page.lines.index("quadratic drag (possible: 42 % probable)") + 1] == "61 nats"
    assert not [line for line in page.lines if line.endswith(": accepted")]
    why = Tried(replace(effect("waves"), variant="2.25 and 2.33 s"), 20.0, False, "30 nats are asked for")
    tried = with_figure(diagnosis(tried=(*diagnosis().tried, why)), "candidates")
    assert "waves (2.25 and 2.33 s) (30 nats are asked for)\n20 nats" in "\n".join(tried.lines)
    half = replace(drag, probability=0.5)
    assert "quadratic drag: accepted" in with_figure(diagnosis(findings=(half,)), "candidates").lines


def test_the_feed_forward_s_gain_is_told_in_millimetres_a_second_and_where_there_is_none_why():
    gained = diagnosis(
        findings=(finding_of("quadratic_drag", feedforward=Gain(0.0234, 0.0051)), finding_of("dvl_bias"))
    )
    page = read(gained)
    assert "quadratic drag\n23 mm/s\n5.1 mm/s\nquadratic drag" in page
    assert "DVL bias\n—\n—\nnothing: the feed-forward can't" in page


def test_a_speed_is_named_only_above_that_of_rest_and_where_the_gap_goes_with_it():
    def above(low):
        slices = (Slice("surge", "speed", 0.0, low, 0.01), Slice("surge", "speed", low, 0.6, 0.82))
        return gap_words.where_sentence(replace(gap(), slices=slices))

    assert above(0.057).endswith("in surge, steady, mostly above 0.06 m/s")
    assert above(0.0041).endswith("in surge, steady")
    even = tuple(Slice("surge", "speed", 0.2 * k, 0.2 * (k + 1), 0.3) for k in range(3))
    assert gap_words.where_sentence(replace(gap(), slices=even)).endswith("in surge, steady")


@pytest.mark.parametrize(
    ("shares", "said"),
    [
        (
            {("surge", "steady"): 0.35, ("surge", "turning"): 0.25, ("sway", "steady"): 0.4 - 1e-9},
            "most of it lies in surge, most of that steady",
        ),
        (
            {
                ("surge", "steady"): 0.19,
                ("surge", "turning"): 0.15,
                ("surge", "rest"): 0.06,
                ("yaw", "steady"): 0.3,
                ("sway", "steady"): 0.3,
            },
            "the largest part of it lies in surge, the largest part of that steady",
        ),
    ],
)
def test_a_gap_that_is_spread_is_told_by_its_degree_of_freedom(shares, said):
    spread = tuple(Share(*place, share) for place, share in shares.items())
    assert gap_words.where_sentence(replace(gap(), where=spread, slices=())) == said


def test_a_degree_of_freedom_that_drifts_most_without_the_most_force_is_named():
    assert gap_words.drifts_elsewhere(gap()) == ""
    sway = replace(gap(), where=(Share("sway", "steady", 0.8), Share("surge", "steady", 0.2)))
    drifted = (Share("surge", "turning", 0.6), Share("sway", "steady", 0.3), Share("surge", "rest", 0.1))
    sway = replace(sway, drifted=drifted)
    assert gap_words.drifts_elsewhere(sway) == "surge"
    elsewhere = ", while most of the drift in the fitted dive is in surge"
    assert wording.verdict_sentence(diagnosis(gap=sway)).endswith(
        f" Most of it lies in sway, steady{elsewhere}."
    )
    assert elsewhere not in wording.verdict_sentence(diagnosis(gap=replace(sway, drifted=sway.where)))
    assert "This is where force is missing, over what disturbs" in read(diagnosis())
    assert "Most of the drift is in surge." in read(diagnosis(gap=sway))
    assert gap_words.drifts_elsewhere(replace(sway, before=1.1)) == ""


@pytest.mark.parametrize(("share", "word"), [(0.8, "closely"), (0.3, "in part"), (0.05, "hardly")])
def test_how_closely_a_missing_force_goes_with_what_it_depends_on_is_told_in_a_word(share, word):
    depends = (Dependence("surge", "speed", "odd", share),)
    page = read(diagnosis(gap=replace(gap(), depends_on=depends)))
    assert f"surge\nodd\n{word}\n" in page


def test_what_stays_the_same_is_not_sliced_and_a_slice_that_is_the_whole_is_not_shown():
    still = replace(
        gap(), slices=tuple(Slice("surge", "depth", 0.6 + 1e-4 * k, 0.6001 + 1e-4 * k, 0.3) for k in range(3))
    )
    assert "0.60 to 0.60" not in read(diagnosis(gap=still))
    assert "voltage\n" not in read(diagnosis())


@pytest.mark.usefixtures("rendered")
def test_slices_are_in_the_units_of_what_they_slice_by():
    page = read(diagnosis())
    for interval in ("0.30 to 0.60 m/s", "0° to 180°", "2.0 to 5.0 m", "5.0 to 7.5 m"):
        assert interval in page


def test_an_interval_that_has_one_end_alone_is_left_out():
    assert "95 %" in cause_words.value_words("gain", Value(0.8, "1", 0.7, 0.9))
    assert "95 %" not in cause_words.value_words("gain", Value(0.8, "1", -math.inf, 0.9))
    assert "95 %" not in cause_words.value_words("gain", Value(0.8, "1", 0.7, math.inf))


def test_a_plain_baseline_that_runs_away_is_not_told_to_two_decimals():
    wild = replace(SURGE, nrmse_baseline=180.69)
    borne = Shrink(3.1, 1.3, 0.857, 0.79, 0.92, by_axis=(wild, replace(YAW, nrmse_baseline=0.51)))
    page = read(diagnosis(check=borne, heldout=None))
    assert "over 10" in page
    assert "180.69" not in page
    assert "0.51" in page
