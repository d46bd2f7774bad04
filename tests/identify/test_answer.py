"""From a fit to an answer: bounds named, outcomes in their order, what a user reads."""

from dataclasses import replace

import closed_loop
import fitted
import numpy as np
import pytest

from identify.answer import answered
from identify.dive import Signal
from identify.estimators.table import estimator
from identify.identification import Doubt, Outcome, outcome_of

SURGE = {"M_u": 100.0, "D_u": 50.0}


def quiet(*_report):
    pass


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
    found = judged(fitted.fit(values, 1e-4 * np.eye(len(values))))
    assert found.outcome is Outcome.AT_BOUND
    assert words in found[name].reason
    assert not found[name].identifiable
    assert any(name in doubt.about and words in doubt.sentence for doubt in found.doubts)


def test_a_vehicle_without_damping_stops_at_the_bound_of_none(monkeypatch):
    monkeypatch.setattr(closed_loop, "DAMPING", 0.0)
    dive = closed_loop.dive(np.random.default_rng(100_003), seconds=120.0)
    found = estimator("likelihood")(dive, closed_loop.vehicle_file(), "only", quiet)
    assert found.outcome is Outcome.AT_BOUND
    assert "lower bound of 0 N/(m/s); the dive puts it below" in found["D_u"].reason
    assert found["D_u"].low95 == 0.0
    assert found["M_u"].low95 < closed_loop.MASS < found["M_u"].high95


def test_a_damping_that_the_dive_knows_nothing_of_is_at_no_bound():
    found = judged(fitted.fit(SURGE, np.diag([1e-4, 4.0])))
    assert found.outcome is Outcome.CONVERGED
    assert "bound" not in found["D_u"].reason


def test_a_mass_below_the_dry_mass_makes_data_and_model_disagree():
    found = judged(fitted.fit(SURGE | {"M_u": 60.0}, 1e-4 * np.eye(2)))
    assert found.outcome is Outcome.DISAGREES
    assert any("below the rigid body's own 72" in sentence for sentence in found.sentences)


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
    found = judged(fitted.fit(SURGE, 1e-4 * np.eye(2)), dry_mass_std_kg=2.0)
    assert found["X_udot"].std == pytest.approx(np.hypot(1.0, 2.0))
    assert found["X_udot"].high95 - found["X_udot"].value > found["M_u"].high95 - found["M_u"].value


@pytest.mark.parametrize(("relative_std", "known"), [(0.05, True), (0.15, False)])
def test_an_added_mass_follows_the_rule_of_any_coefficient(relative_std, known):
    """Of 100 kg, 28 are added: 15 % of the total are more than half of that."""
    found = judged(fitted.fit(SURGE, relative_std**2 * np.eye(2)))
    assert found["M_u"].identifiable
    assert found["X_udot"].identifiable is known
    if not known:
        assert "X_udot is M_u less the rigid body's own 72 kg: the 28 that is left" in found["X_udot"].reason


def test_the_json_has_what_each_parameter_hangs_on():
    relative = 1e-4 * np.array([[1.0, -0.5], [-0.5, 1.0]])
    data = judged(fitted.fit(SURGE, relative)).to_json()
    mass = data["parameters"][0]
    assert mass["relative_std"] == pytest.approx(0.01)
    assert mass["partner"] == {"name": "D_u", "correlation": pytest.approx(-0.5)}
    assert mass["share_from_prior"] == 0.0
    assert mass["scale_std"] == pytest.approx(10.0)
    assert data["parameters"][1]["partner"] is None
    assert data["thrust_scale"]["in_intervals"] is False


def test_masses_by_an_autopilots_own_velocity_are_warned_of_and_those_by_a_dvl_are_not():
    made = fitted.fit({"M_u": 100.0, "D_u": 40.0}, 1e-4 * np.eye(2))
    by_filter = answered(made, replace(fitted.dive(), velocity_is_filtered=True), fitted.vehicle_file())
    assert [doubt.about for doubt in by_filter.doubts] == [("M_u", "M_v", "M_w")]
    assert by_filter.outcome is Outcome.CONVERGED
    assert answered(made, fitted.dive(), fitted.vehicle_file()).doubts == ()
