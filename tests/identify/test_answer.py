"""From a fit to an answer: outcomes, bounds, and directions that a dive can't resolve."""

import math
from dataclasses import replace

import closed_loop
import fitted
import numpy as np
import pytest
from fakes.planted import quiet
from hypothesis import given, settings
from hypothesis import strategies as st

from gcs_plugin.mavproxy.work import identified_lines
from identify.dive import Signal
from identify.doubt import Doubt, Outcome
from identify.estimators.answer import answered
from identify.estimators.identifiability import null_directions, partners_of
from identify.estimators.table import estimator
from identify.identification import Information, outcome_of

SURGE = {"M_u": 100.0, "D_u": 50.0}


def judged(fit, **keys):
    return answered(fit, fitted.dive(), fitted.vehicle_file(**keys))


@pytest.mark.parametrize(
    ("name", "value", "words"),
    [
        ("M_u", 0.1, "lower bound of 0.1 kg"),
        ("M_u", 3e5, "upper bound of 100000 kg"),
        ("D_u", 2e5, "upper bound of 100000 N/(m/s)"),
        ("I_r", 1e-4, "lower bound of 0.001 kg m2"),
    ],
)
def test_a_value_at_a_bound_of_the_list_is_held_there_and_named(name, value, words):
    values = SURGE | {name: value}
    answer = judged(fitted.fit(values, 1e-4 * np.eye(len(values))))
    assert answer.outcome is Outcome.AT_BOUND
    assert words in answer[name].reason
    assert not answer[name].identifiable
    assert any(name in doubt.about and words in doubt.sentence for doubt in answer.doubts)


def test_a_vehicle_without_damping_stops_at_the_bound_of_none(monkeypatch):
    monkeypatch.setattr(closed_loop, "DAMPING", 0.0)
    dive = closed_loop.dive(np.random.default_rng(100_003), seconds=120.0)
    answer = estimator("likelihood")(dive, closed_loop.vehicle_file(), "only", quiet)
    assert answer.outcome is Outcome.AT_BOUND
    assert "lower bound of 0 N/(m/s); the dive puts it below" in answer["D_u"].reason
    assert answer["D_u"].low95 == 0.0
    assert answer["M_u"].low95 < closed_loop.MASS < answer["M_u"].high95


def test_a_damping_that_the_dive_knows_nothing_of_is_at_no_bound():
    answer = judged(fitted.fit(SURGE, np.diag([1e-4, 4.0])))
    assert answer.outcome is Outcome.CONVERGED
    assert "bound" not in answer["D_u"].reason


def test_a_mass_below_the_dry_mass_makes_data_and_model_disagree():
    answer = judged(fitted.fit(SURGE | {"M_u": 60.0}, 1e-4 * np.eye(2)))
    assert answer.outcome is Outcome.DISAGREES
    assert any("below the rigid body's own 72" in sentence for sentence in answer.sentences)


@pytest.mark.parametrize(
    ("mass_kg", "words"),
    [(60.0, "which no water can take away"), (612.0, "which no water round it can make up")],
)
def test_a_mass_that_no_such_vehicle_has_is_not_known_and_goes_nowhere(mass_kg, words):
    """612 kg are 8.5 times the dry mass: less than what tells nothing of its axis, and more than water can add."""
    answer = judged(fitted.fit(SURGE | {"M_u": mass_kg}, 1e-4 * np.eye(2)))
    assert answer.values() == {"D_u": 50.0}
    assert words in answer["M_u"].reason
    assert words in answer["X_udot"].reason


def test_a_mass_that_no_such_vehicle_has_stays_unknown_beside_priors_of_others():
    fit = fitted.fit(SURGE | {"M_u": 612.0}, 1e-4 * np.eye(2))
    answer = judged(fit, priors={"D_u": fitted.prior(50.0, 0.02)})
    assert answer["D_u"].share_from_prior > 0.0
    assert answer.values().keys() == {"D_u"}


def test_thrusters_of_the_wrong_sign_give_no_parameter():
    dive = closed_loop.dive(np.random.default_rng(100_004), seconds=120.0)
    wrong = replace(dive, tau_cmd=Signal(dive.tau_cmd.time_s, -dive.tau_cmd.value))
    assert estimator("likelihood")(wrong, closed_loop.vehicle_file(), "only", quiet).values() == {}


def test_the_worst_doubt_is_the_outcome():
    good = fitted.fit(SURGE, 1e-4 * np.eye(2)).parameters
    doubts = [Doubt((), "a", "", Outcome.DISAGREES), Doubt((), "b"), Doubt((), "c", "", Outcome.AT_BOUND)]
    assert outcome_of(good, doubts) is Outcome.DISAGREES
    assert outcome_of(good, doubts[1:]) is Outcome.AT_BOUND
    assert outcome_of(good, doubts[1:2]) is Outcome.CONVERGED
    assert outcome_of([p for p in good if not p.identifiable], doubts) is Outcome.NOT_IDENTIFIABLE


def test_what_an_estimator_itself_ended_in_is_not_made_better():
    fit = fitted.fit(SURGE, 1e-4 * np.eye(2), outcome=Outcome.DISAGREES)
    assert judged(fit).outcome is Outcome.DISAGREES


def test_the_added_mass_is_wider_by_the_dry_mass():
    answer = judged(fitted.fit(SURGE, 1e-4 * np.eye(2)), dry_mass_std_kg=2.0)
    assert answer["X_udot"].std == pytest.approx(np.hypot(1.0, 2.0))
    assert answer["X_udot"].high95 - answer["X_udot"].value > answer["M_u"].high95 - answer["M_u"].value


@pytest.mark.parametrize(("relative_std", "known"), [(0.05, True), (0.15, False)])
def test_an_added_mass_follows_the_rule_of_any_coefficient(relative_std, known):
    """Of 100 kg, 28 are added: 15 % of the total are more than half of that."""
    answer = judged(fitted.fit(SURGE, relative_std**2 * np.eye(2)))
    assert answer["M_u"].identifiable
    assert answer["X_udot"].identifiable is known
    if not known:
        assert "X_udot is M_u less the rigid body's own 72 kg: the 28 that is left" in answer["X_udot"].reason


def test_the_json_has_what_each_parameter_hangs_on():
    relative = 1e-4 * np.array([[1.0, -0.5], [-0.5, 1.0]])
    data = judged(fitted.fit(SURGE, relative)).to_json()
    mass = data["parameters"][0]
    # 1 % by the dive, 10 % by the thrust.
    assert mass["relative_std"] == pytest.approx(math.hypot(0.01, 0.1))
    assert mass["std"] == pytest.approx(100.0 * math.hypot(0.01, 0.1))
    assert math.log(mass["high95"] / 100.0) == pytest.approx(1.96 * math.hypot(0.01, 0.1), rel=1e-3)
    assert math.log(100.0 / mass["low95"]) == pytest.approx(1.96 * math.hypot(0.01, 0.1), rel=1e-3)
    assert (mass["given_thrust"], mass["given_thrust_std"]) == pytest.approx((100.0, 1.0))
    assert math.log(mass["given_thrust_high95"] / 100.0) == pytest.approx(1.96 * 0.01, rel=1e-3)
    assert math.log(100.0 / mass["given_thrust_low95"]) == pytest.approx(1.96 * 0.01, rel=1e-3)
    assert mass["partner"] == {"name": "D_u", "correlation": pytest.approx(-0.5)}
    assert mass["share_from_prior"] == 0.0
    assert mass["scale_std"] == pytest.approx(10.0)
    assert data["parameters"][1]["partner"] is None
    assert data["thrust_scale"]["weighed"] is False


def test_masses_by_an_autopilots_own_velocity_are_warned_of_and_those_by_a_dvl_are_not():
    made = fitted.fit({"M_u": 100.0, "D_u": 40.0}, 1e-4 * np.eye(2))
    by_filter = answered(made, replace(fitted.dive(), velocity_is_filtered=True), fitted.vehicle_file())
    assert [doubt.about for doubt in by_filter.doubts] == [("M_u", "M_v", "M_w")]
    assert by_filter.outcome is Outcome.CONVERGED
    assert answered(made, fitted.dive(), fitted.vehicle_file()).doubts == ()


SURGE_AXIS = ("M_u", "D_u", "surge_trim")
STRONG = 1e4


def knowing(of, *directions):
    """Information that knows everything but these directions."""
    null = np.linalg.qr(np.array(directions, dtype=float).T)[0] if directions else np.zeros((len(of), 0))
    return Information(tuple(of), STRONG * (np.eye(len(of)) - null @ null.T))


@pytest.mark.parametrize(
    ("of", "direction", "names", "words"),
    [
        (
            SURGE_AXIS,
            [0, 1, -1],
            {"D_u", "surge_trim"},
            "hold surge at a second speed, best one in the other dir",
        ),
        (SURGE_AXIS, [1, 0, 0], {"M_u"}, "too little of surge mass (M_u)"),
        (SURGE_AXIS, [1, 1, 0], {"M_u", "D_u"}, "only their ratio is known"),
        (SURGE_AXIS, [1, -1, 0], {"M_u", "D_u"}, "steady speeds"),
        (("M_u", "M_v", "D_u"), [1, 1, 0], {"M_u", "M_v"}, "drive surge and sway one at a time"),
    ],
)
def test_what_a_dive_can_not_tell_apart_is_told_with_what_to_dive(of, direction, names, words):
    (null_direction,) = null_directions(knowing(of, direction))
    assert set(null_direction.weights) == names
    assert [abs(weight) for weight in null_direction.weights.values()] == pytest.approx(
        [len(names) ** -0.5] * len(names)
    )
    assert words in null_direction.sentence
    assert null_direction.relative_std > 1e3


def test_a_dive_that_tells_all_or_all_but_a_trim_has_no_null_direction():
    assert null_directions(knowing(SURGE_AXIS)) == null_directions(knowing(SURGE_AXIS, [0, 0, 1])) == ()


@settings(max_examples=30)
@given(st.floats(0.02, 3.1), st.floats(1e-3, 1.0))
def test_sets_do_not_depend_on_how_the_null_space_is_turned(angle, weak):
    of = (*SURGE_AXIS, "M_v", "D_v", "sway_trim")
    first = np.array([0, 1, -1, 0, 0, 0]) / np.sqrt(2)
    second = np.array([0, 0, 0, 1, -1, 0]) / np.sqrt(2)
    turned = [np.cos(angle) * first + np.sin(angle) * second, np.cos(angle) * second - np.sin(angle) * first]
    information = knowing(of, *turned)
    information = Information(of, information.matrix + weak * np.outer(turned[0], turned[0]))
    members = {name for null_direction in null_directions(information) for name in null_direction.weights}
    assert members == {"D_u", "surge_trim", "M_v", "D_v"}


def test_the_strongest_partner_is_the_one_of_the_largest_correlation():
    relative = np.array([[1.0, 0.5, -0.8], [0.5, 1.0, 0.0], [-0.8, 0.0, 1.0]])
    partners = partners_of(("M_u", "D_u", "M_v"), relative * np.outer([3, 2, 1], [3, 2, 1]))
    assert (partners["M_u"].name, partners["M_u"].correlation) == ("M_v", pytest.approx(-0.8))
    assert partners["D_u"].name == "M_u"


def test_without_information_the_covariance_tells_the_null_direction():
    relative = 1e-4 * np.eye(2) + 2.0 * np.ones((2, 2))
    answer = answered(
        fitted.fit({"M_u": 100.0, "D_u": 50.0}, relative), fitted.dive(), fitted.vehicle_file(0.0)
    )
    (direction,) = answer.null_directions
    assert set(direction.weights) == {"M_u", "D_u"}
    assert direction.relative_std == pytest.approx(np.sqrt(4.0 + 1e-4), rel=1e-3)


def told_of(relative, of=("M_u", "D_u"), **keys):
    values = dict(zip(of, (100.0, 50.0), strict=True))
    return answered(fitted.fit(values, relative, **keys), fitted.dive(), fitted.vehicle_file(0.0))


def test_what_is_identifiable_is_not_said_to_be_untellable():
    answer = told_of(1e-4 * np.eye(2), information=knowing(("M_u", "D_u"), [1, 1]))
    assert answer.null_directions == ()


def test_beside_an_identifiable_one_the_other_alone_is_named():
    answer = told_of(np.diag([1e-4, 4.0]), information=knowing(("M_u", "D_u"), [1, 2]))
    (direction,) = answer.null_directions
    assert direction.sentence.startswith("The dive says too little of surge damping (D_u)")


@pytest.mark.parametrize(("std", "unknown"), [(0.34, False), (2.0, True)])
def test_only_what_is_unknown_is_called_known_by_its_ratio_alone(std, unknown):
    along = np.array([1.0, 1.0]) / np.sqrt(2)
    information = knowing(("M_u", "D_u"), along)
    (null_direction,) = null_directions(
        Information(information.of, information.matrix + std**-2 * np.outer(along, along))
    )
    assert ("only their ratio is known" in null_direction.sentence) is unknown


def test_nobody_is_told_to_push_where_no_thruster_pushes():
    of = ("I_q", "D_q")
    answer = told_of(np.diag([4.0, 4.0]), of, information=knowing(of, [1, 1]), rest_on_righting=of)
    (direction,) = answer.null_directions
    assert "no thruster pushed pitch" in direction.sentence
    assert "harder" not in direction.sentence


def test_thrust_scale_and_all_masses_and_dampings_are_told_as_one():
    answer = answered(
        fitted.fit({"M_u": 100.0, "D_u": 50.0}, 1e-4 * np.eye(2)), fitted.dive(), fitted.vehicle_file(0.1)
    )
    (direction,) = answer.null_directions
    assert set(direction.weights) == {"thrust_scale", "M_u", "D_u"}
    assert "weigh the vehicle, or hang 0.5 kg on it" in direction.sentence
    assert answer.to_json()["null_directions"][0]["relative_std"] is None


def test_a_line_of_the_console_has_both_intervals():
    relative = 1e-4 * np.array([[1.0, -0.5], [-0.5, 1.0]])
    data = judged(fitted.fit(SURGE, relative)).to_json()
    lines = list(identified_lines(data))
    assert lines[1] == "M_u 100 kg (95 %: 82.12 to 121.8; given the thrust 98.06 to 102)"
