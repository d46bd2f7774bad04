"""Which effect changed further runs, judged by accepted ones, on runs whose change is known."""

import json
from pathlib import Path

import jsonschema
import numpy as np
import pytest

from bridge.errors import FitError, LogError
from identify.repeats.answer import plain, sentences
from identify.repeats.marks import usual_from
from identify.run.repeats import accept, judge

SCHEMA = Path(__file__).resolve().parents[1] / "data" / "answers.schema.json"
AIR_M = 101_325.0 / (998.2 * 9.80665)


@pytest.fixture(scope="module")
def usual(sound):
    return accept(sound.dives(60, 1), sound.file, "quadrotor")


def answer(sound, usual, seed=4, count=10, **changes):
    return judge(sound.but(**changes).dives(count, seed), sound.file, "quadrotor", usual)


def test_sound_runs_are_told_to_be_so(sound, usual):
    verdicts = [answer(sound, usual, seed).verdict for seed in range(10, 40)]
    assert verdicts.count("no_gap") >= 28


def test_the_accepted_runs_themselves_have_no_gap(sound, usual):
    assert judge(sound.dives(60, 1), sound.file, "quadrotor", usual).verdict == "no_gap"


def test_runs_with_a_weight_are_heavier_by_it_and_it_may_be_payload(sound, usual):
    judged = answer(sound, usual, heavier_n=2.0)
    assert judged.finding is not None
    assert judged.verdict == "ambiguous"
    assert (judged.finding.name, judged.finding.also) == ("net_buoyancy", ("added_payload",))
    force = judged.finding.parameters["force"]
    assert force.low95 <= -2.0 <= force.high95
    assert judged.finding.probability > 0.99


def test_a_gain_on_the_absolute_pressure_shows_at_the_surface(sound, usual):
    judged = answer(sound, usual, reads_m=0.01 * AIR_M)
    assert judged.finding is not None
    assert (judged.verdict, judged.finding.name, judged.finding.also) == ("explained", "depth_scale", ())
    assert judged.finding.parameters["scale"].value == pytest.approx(1.01, abs=1e-3)


@pytest.mark.parametrize("number", [1, 2, 3, 4])
def test_a_weak_thruster_is_named_by_its_number_with_what_is_left_of_its_thrust(sound, usual, number):
    gains = tuple(0.6 if k == number else 1.0 for k in range(1, 5))
    judged = answer(sound, usual, gains=gains)
    assert judged.finding is not None
    assert (judged.verdict, judged.finding.name) == ("explained", "weak_thruster")
    assert judged.finding.parameters["thruster"].value == number
    gain = judged.finding.parameters["gain"]
    assert gain.low95 <= 0.6 <= gain.high95
    assert gain.high95 < 0.9


def test_a_run_that_can_t_tell_two_weak_thrusters_apart_names_both_and_says_so(sound, usual):
    judged = answer(sound, usual, seed=6, count=1, gains=(1.0, 0.85, 1.0, 1.0))
    assert judged.finding is not None
    assert judged.verdict == "ambiguous"
    assert {judged.finding.cause.effect.number, *judged.finding.other_thrusters} == {2, 3}
    assert sentences(judged)[0].startswith("Weak thruster 3 or weak thruster 2 explains the gap: gain 0.7")
    assert plain(judged)["effects"][0]["other_thrusters"] == [2]
    alone = judged.evidence["weak_thruster of thruster 3"], judged.evidence["weak_thruster of thruster 2"]
    weighed = np.logaddexp.reduce(alone) - np.logaddexp.reduce([0.0, *judged.evidence.values()])
    assert judged.finding.probability == pytest.approx(np.exp(weighed))


def test_the_more_runs_the_smaller_the_fault_that_shows(sound, usual):
    gains = (0.9, 1.0, 1.0, 1.0)
    few, many = (answer(sound, usual, count=count, gains=gains) for count in (2, 60))
    assert few.verdict == "no_gap"
    assert many.finding is not None
    assert many.finding.name == "weak_thruster"


def test_what_no_candidate_explains_is_told_as_that(sound, usual):
    judged = answer(sound, usual, moment_nm=(0.0, 0.0, 0.6))
    assert (judged.verdict, judged.finding, judged.left) == ("unknown", None, ("yaw",))


def test_what_a_cause_leaves_over_is_told(sound, usual):
    judged = answer(sound, usual, moment_nm=(0.0, 0.0, 0.3), reads_m=0.01 * AIR_M)
    assert judged.finding is not None
    assert (judged.verdict, judged.finding.name) == ("partly", "depth_scale")
    assert "yaw" in judged.left
    assert sentences(judged)[0].startswith("Depth scale explains part of the gap: ")
    assert any(sentence.startswith("It leaves something in ") for sentence in sentences(judged))
    assert plain(judged)["gap"]["unexplained"] > 0.2


def test_every_answer_keeps_to_the_schema_and_is_said_in_sentences(sound, usual):
    schema = json.loads(SCHEMA.read_text(encoding="utf-8"))
    for changes in ({}, {"heavier_n": 2.0}, {"reads_m": 0.1}, {"gains": (0.5, 1.0, 1.0, 1.0)}):
        judged = answer(sound, usual, **changes)
        data = plain(judged)
        jsonschema.validate(json.loads(json.dumps(data, allow_nan=False)), schema)
        assert sum(part["share"] for part in data["gap"]["where"]) == pytest.approx(1.0)
        assert sentences(judged)[-1].startswith("Against the accepted runs, 10 runs together differ by: rest")
    heavier = sentences(answer(sound, usual, heavier_n=2.0))[0]
    assert heavier.startswith("Net buoyancy or added payload explains the gap: force −")
    assert sentences(answer(sound, usual))[0].startswith("No gap")


def test_what_would_tell_causes_apart_is_said_and_answered_where_runs_do_not_and_nowhere_else(sound, usual):
    alike, sure = answer(sound, usual, heavier_n=2.0), answer(sound, usual, reads_m=0.01 * AIR_M)
    assert any(each.startswith("This dive can't tell it from added payload ") for each in sentences(alike))
    assert plain(alike)["next"]["splits"] == ["net_buoyancy", "added_payload"]
    assert not any("can't tell" in each for each in sentences(sure))
    assert plain(sure)["next"] is None


def test_a_single_run_is_spoken_of_as_one(sound, usual):
    judged = judge(sound.dives(1, 3), sound.file, "quadrotor", usual)
    assert sentences(judged)[-1].startswith("Against the accepted runs, this run differs by: rest depth")


def test_without_a_run_that_pushes_from_rest_there_is_nothing_to_judge(sound, usual):
    with pytest.raises(FitError, match="none of the runs"):
        judge([sound.but(rest_s=0.0).dive()], sound.file, "quadrotor", usual)


def test_what_is_not_accepted_runs_is_refused():
    for wrong in ({}, {"mean": [0.0], "scatter": [[1.0]], "thrust_n": [1.0]}, {"mean": "x"}):
        with pytest.raises(LogError, match="holds no accepted runs"):
            usual_from(wrong)


def test_an_accepted_file_of_another_shape_is_refused(usual):
    with pytest.raises(LogError, match="holds no accepted runs"):
        usual_from({**usual.to_json(), "mean": np.zeros(4).tolist()})
