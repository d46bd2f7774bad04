"""The verdict of a diagnosis: which cause it names, how sure it is of it, and what the drift falls to."""

from dataclasses import replace

import numpy as np
import pytest
from made_diagnoses import NAN, UNKNOWN, diagnosis, found, gap, read

from identify.diagnose import wording, wording_verdict
from identify.diagnose.candidates import Cause
from identify.diagnose.mounting import mounted_otherwise
from identify.diagnose.result import AxisShrink, Disturbance, Finding, Share, Shrink
from identify.effects.sensors import WRONG_FEEDBACK_LOG

NOTHING = Shrink(1.02, 1.01, NAN, NAN, NAN)

pytestmark = pytest.mark.usefixtures("sketched")


def test_the_verdict_says_cause_place_speed_and_what_the_drift_falls_to():
    said = wording_verdict.verdict_sentence(diagnosis(check=None, heldout=None))
    assert said == (
        "Quadratic drag explains the gap: 71 % of it is in surge, steady, mostly above 0.30 m/s; "
        "with it the model's 5 s drift falls from 3.4 to 0.85 floors."
    )


@pytest.mark.parametrize(
    ("other", "ending"),
    [
        ({}, "falls from 3.1 to 1.3 floors on the check dive."),
        ({"check": None}, "falls from 3.4 to 1.2 floors on pieces held out."),
        ({"check": Shrink(3.0, 3.5, -0.25, NAN, NAN)}, "goes from 3.0 to 3.5 floors on the check dive."),
    ],
)
def test_the_verdict_speaks_of_the_best_evidence_there_is(other: dict[str, object], ending: str):
    assert wording_verdict.verdict_sentence(diagnosis(**other)).endswith(ending)


def test_a_check_dive_that_does_not_bear_the_cause_out_is_told_in_the_headline():
    told = diagnosis(heldout=Shrink(3.0, 1.0, 0.98, 0.95, 1.0), check=Shrink(3.0, 2.8, 0.11, 0.0, 0.2))
    but = "but the check dive does not bear that out (98 % of what can be closed was foretold to close there, and "
    assert but in wording_verdict.verdict_sentence(told)
    assert but in wording_verdict.verdict_sentence(replace(told, verdict="unknown"))


def test_two_causes_are_named_as_two():
    said = wording_verdict.verdict_sentence(
        diagnosis(findings=(found("quadratic_drag"), found("weak_thruster", 3)))
    )
    assert said.startswith("Quadratic drag and weak thruster 3 explain the gap: ")


def test_causes_that_can_not_be_told_apart_are_named_together():
    lag = found("thruster_lag", also=("command_delay",), likeness={"command_delay": 0.97})
    said = diagnosis(verdict="ambiguous", findings=(lag,))
    assert wording_verdict.verdict_sentence(said).startswith(
        "Thruster lag or command delay explains the gap, but this dive can't tell thruster lag from command delay: "
    )
    (line,) = wording.cause_lines(said)
    told = (
        "This dive can't tell it from command delay (likeness 0.97); what would: shaft speeds, and fast steps in a "
        "log of 50 Hz."
    )
    assert line.endswith(told)
    assert f"{told}\nLikeness: at 1 no method could tell" in read(said)


def test_a_dive_without_a_gap_is_told_so_and_names_no_cause():
    quiet = diagnosis(verdict="no_gap", gap=gap(1.02, 1.02), findings=(), heldout=NOTHING, check=None)
    assert wording_verdict.verdict_sentence(quiet) == (
        "No gap: the model's 5 s drift is 1.0 floors, where noise alone would give 1 (0.8 to 1.2 by chance), and no "
        "candidate explains any of it."
    )
    assert wording.cause_lines(quiet) == ()
    assert wording_verdict.shrink_lines(quiet) == (
        "On pieces held out: the 5 s drift goes from 1.0 floors to 1.0 floors; there is too little gap to shrink.",
    )
    assert "No candidate of the library explains anything that noise would not." in read(quiet)


def test_a_drift_beyond_chance_that_nothing_explains_is_never_called_no_gap():
    drifting = diagnosis(verdict="no_gap", gap=gap(3.0, 3.0), findings=(), heldout=NOTHING, check=None)
    assert wording_verdict.verdict_sentence(drifting) == (
        "Nothing that lasts: the model's 5 s drift is 3.0 floors, where noise alone would give 1 (0.8 to 1.2 by "
        "chance), but neither a candidate nor any force that returns explains it."
    )
    page = read(drifting)
    assert "There is no gap" not in page
    assert "fly the same again to see whether it lasts" in page


def test_what_no_candidate_explains_is_described():
    said = diagnosis(verdict="unknown", character=UNKNOWN)
    assert wording_verdict.verdict_sentence(said) == (
        "Something is there that no candidate explains: 71 % of it is in surge, steady, mostly above 0.30 m/s; it is "
        "fixed to the world, even in speed, intermittent, and goes with heading and yaw rate. Quadratic drag explains "
        "part of the gap."
    )
    page = read(said)
    assert "What no candidate explains: It acts in yaw. It is fixed to the world." in page
    assert "It goes with heading and yaw rate." in page


def test_a_cause_less_probable_than_not_is_told_as_possible():
    bias = found("thrust_bias", probability=0.42)
    beside = wording_verdict.verdict_sentence(diagnosis(findings=(found("quadratic_drag"), bias)))
    assert beside.startswith(
        "Quadratic drag explains the gap; thrust bias (42 % probable) may explain some of it, too: 71 % of it "
    )
    alone = wording_verdict.verdict_sentence(diagnosis(findings=(bias,)))
    assert alone.startswith("Thrust bias (42 % probable) may explain the gap: ")
    unknown = wording_verdict.verdict_sentence(diagnosis(verdict="unknown", findings=(bias,)))
    assert unknown.endswith("Thrust bias (42 % probable) may explain part of the gap.")


def test_what_is_recorded_and_not_the_motion_is_never_said_to_make_the_drift_fall():
    heard = Finding(Cause(WRONG_FEEDBACK_LOG, np.zeros(0)), (), {}, 0.9, {}, 0.0)
    said = wording_verdict.verdict_sentence(
        diagnosis(findings=(heard,), heldout=Shrink(0.99, 0.99, NAN, NAN, NAN), check=None)
    )
    assert said.endswith(
        "it shows in what is recorded, not in the motion: with it or without, the model's 5 s drift is 0.99 floors on "
        "pieces held out, where noise alone would give 1 (0.8 to 1.2 by chance)."
    )


def test_a_cause_that_makes_no_drift_is_said_to_open_no_gap():
    lag = replace(found("thruster_lag"), probability=0.89)
    small = replace(gap(), before=1.02)
    said = wording_verdict.verdict_sentence(
        diagnosis(findings=(lag,), gap=small, heldout=Shrink(0.96, 0.96, NAN, NAN, NAN), check=None)
    )
    assert said.startswith("Thruster lag shows, but opens no gap: ")
    assert "% of what shows is in " in said
    chance = wording_verdict.verdict_sentence(
        diagnosis(findings=(lag,), gap=small, heldout=Shrink(0.98, 0.91, NAN, NAN, NAN), check=None)
    )
    assert chance.startswith("Thruster lag shows, but opens no gap: ")
    assert chance.endswith(
        "; without it the model's 5 s drift is 0.98 floors, with it 0.91 floors on pieces held out, where noise alone "
        "would give 1 (0.8 to 1.2 by chance)."
    )
    closes = diagnosis(findings=(lag,), gap=small, heldout=Shrink(1.15, 1.0, 0.9, NAN, NAN), check=None)
    assert wording_verdict.verdict_sentence(closes).startswith("Thruster lag explains the gap: ")
    wide = wording_verdict.verdict_sentence(
        diagnosis(findings=(lag,), heldout=Shrink(0.96, 0.96, NAN, NAN, NAN), check=None)
    )
    assert wide.startswith("Thruster lag explains the gap: ")


def test_what_nothing_can_be_relied_on_for_comes_before_the_cause():
    first = mounted_otherwise((0,), ())
    said = wording_verdict.verdict_sentence(diagnosis(first=first, provisos=("Heave was not judged.",)))
    assert said.startswith(
        "The recorded motion does not go the way the thrust pushes, and no cause can be relied on until that is "
        "mended. In surge the recorded velocity runs against the thrust: "
    )
    assert said.index("Quadratic drag explains") > said.index("check both")
    assert said.endswith(" Heave was not judged.")
    assert mounted_otherwise((), ()) == ()


def test_what_is_borne_out_in_part_is_named_and_the_rest_told_beside_it_with_its_share():
    rest = replace(gap(), unexplained_where=(Share("yaw", "turning", 1.0),), unexplained=0.38)
    said = wording_verdict.verdict_sentence(diagnosis(verdict="partly", gap=rest, character=UNKNOWN))
    assert said.startswith("Quadratic drag explains part of the gap: 71 % of it is in surge, steady")
    assert "falls from 3.1 to 1.3 floors on the check dive. Something is left that no candidate" in said
    assert "explains, 38 % of what can be closed on pieces held out: 100 % of that is in yaw, turning" in said
    assert "38 %" not in wording_verdict.verdict_sentence(
        diagnosis(verdict="partly", gap=replace(rest, unexplained=NAN), character=UNKNOWN)
    )


def test_a_disturbance_that_takes_a_third_is_told_in_newtons_in_per_cent_and_with_what_it_may_be():
    taken = (Disturbance("surge", 3.1, 0.62, True), Disturbance("sway", 0.2, 1.0, False))
    said = wording_verdict.verdict_sentence(
        diagnosis(verdict="unknown", findings=(), gap=replace(gap(), disturbance=taken))
    )
    assert "in surge it takes 3.1 N, 62 % of the variance of the thrusters' force." in said
    assert "a tether, or thrust that the vehicle file or the recording has wrong" in said
    assert "sway" not in said
    (line,) = wording.disturbance_line(taken)
    assert "in surge 3.1 N (62 %) and in sway 0.20 N (over 99 %, only held)" in line
    assert "More than a third is much" in line
    assert wording.disturbance_line(()) == ()


SURGE = AxisShrink("surge", 0.034, 0.016, 0.009, 0.72, 0.61, 0.28, 0.33)
YAW = AxisShrink("yaw", 0.02, 0.018, 0.017, 0.5, 0.4, 0.3, 0.9)


def test_the_verdict_and_its_lines_tell_the_drift_in_absolute_terms_by_degree_of_freedom():
    told = diagnosis(check=Shrink(3.1, 1.3, 0.857, 0.79, 0.92, by_axis=(SURGE, YAW)), heldout=None)
    assert wording_verdict.verdict_sentence(told).endswith(
        "with it the model's 5 s drift falls from 34 mm/s to 16 mm/s in surge and from 1.1 °/s to 1.0 °/s in yaw (all "
        "together from 3.1 to 1.3 floors) on the check dive."
    )
    _, surge, yaw, pooled = wording_verdict.shrink_lines(told)
    assert surge == (
        "On the check dive, surge: the 5 s drift goes from 34 mm/s to 16 mm/s (noise alone 9.0 mm/s), 72 % of what can "
        "be closed; NRMSE 0.61 to 0.28 (R² 0.628 to 0.922), plain least squares 0.33."
    )
    assert yaw.startswith("On the check dive, yaw: the 5 s drift goes from 1.1 °/s to 1.0 °/s")
    assert pooled.startswith("On the check dive, all together: the 5 s drift goes from 3.1 floors to 1.3")


def test_a_drift_that_grows_in_a_degree_of_freedom_does_not_fall():
    worse = replace(YAW, after=0.03)
    assert wording.changes(Shrink(2.0, 2.0, 0.0, NAN, NAN, by_axis=(worse, SURGE))).startswith("goes ")
    same = replace(YAW, value=NAN)
    assert wording.changes(Shrink(2.0, 2.0, 0.0, NAN, NAN, by_axis=(same,))) == ""
