"""What the likelihood promises: true values inside its intervals in closed loop, and doubts said out loud."""

from dataclasses import replace

import closed_loop
import numpy as np
import pytest
from fakes.planted import quiet
from fakes.shared import shared
from fakes.vehicle import VEHICLE
from fitted import gaussian, weigh

from bridge.vehicle.config import load_vehicle
from identify.dive import Signal
from identify.doubt import Outcome
from identify.estimators.likelihood.scoring import climb
from identify.estimators.table import estimator
from identify.ingest.open import read_dive

estimate = estimator("likelihood")


def fit(dive):
    return estimate(dive, closed_loop.vehicle_file(), "only", quiet)


def test_mass_and_damping_lie_in_their_intervals_as_often_as_they_should():
    inside, errors = closed_loop.hits(fit, seconds=90.0)
    assert inside >= 53
    assert 0.75 < np.std(errors) < 1.3


def test_an_axis_without_thrust_is_called_not_identifiable_with_a_reason():
    answer = fit(closed_loop.dive(np.random.default_rng(3), seconds=60.0))
    assert not answer["M_v"].identifiable
    assert "no velocity in sway" in answer["M_v"].reason
    assert "no rate of turn in yaw" in answer["I_r"].reason
    assert answer.to_json()["parameters"][1]["value"] is None


def test_the_innovations_of_a_plain_dive_are_white_and_of_spread_one():
    value = fit(closed_loop.dive(np.random.default_rng(3))).innovations["surge"].value[:, 0]
    assert np.std(value) == pytest.approx(1.0, abs=0.03)
    assert abs(np.corrcoef(value[1:], value[:-1])[0, 1]) < 3 / np.sqrt(len(value))


def test_quadratic_drag_makes_data_and_model_disagree_and_says_in_which_axis():
    answer = fit(closed_loop.dive(np.random.default_rng(4), quadratic=40.0))
    assert answer.outcome is Outcome.DISAGREES
    assert any("surge" in note and "speed squared" in note for note in answer.sentences)
    assert answer["D_u"].low95 < closed_loop.DAMPING < answer["D_u"].high95


class Line:
    """Innovations of y = a x + noise of known spread: its maximum and information are those of least squares."""

    def __init__(self):
        self.x = np.linspace(-1, 1, 50)
        self.y = 3.0 * self.x + 0.1 * np.cos(40 * self.x)
        self.difference = np.array([1e-3])
        self.prior_mean, self.prior_precision = np.zeros(1), np.zeros(1)

    def innovations(self, theta):
        return self.y - theta[0] * self.x, np.full(50, 0.25)

    def log_likelihood(self, theta):
        return gaussian(*self.innovations(theta))

    def score(self, theta):
        return weigh(*self.innovations(theta), -self.x[None], np.zeros((1, 50)))


def test_scoring_finds_the_least_squares_answer_and_its_information():
    line = Line()
    summit = climb(line, np.array([0.0]))
    assert summit.converged
    assert summit.theta[0] == pytest.approx(line.x @ line.y / (line.x @ line.x), rel=1e-6)
    assert summit.information[0, 0] == pytest.approx(line.x @ line.x / 0.25)
    gradient, _ = line.score(summit.theta)
    assert abs(gradient[0]) < 1e-3 * np.sqrt(summit.information[0, 0])


def test_a_step_that_leaps_over_the_summit_is_not_taken_for_the_last():
    """Half the information that the data have makes every scoring step land on the other side, nearly as high."""
    line = Line()
    best = line.x @ line.y / (line.x @ line.x)

    class TooLittleInformation(Line):
        def score(self, theta):
            gradient, information = super().score(theta)
            return gradient, 0.55 * information

    started_off = 0.1 / np.sqrt(line.x @ line.x / 0.25)
    summit = climb(TooLittleInformation(), np.array([best + started_off]))
    assert summit.converged
    assert abs(summit.theta[0] - best) < 0.1 * started_off


def test_a_dive_made_elsewhere_has_its_truth_in_the_99_percent_intervals():
    truth = {"M_u": 111.6, "M_v": 112.41, "M_w": 134.0, "I_r": 16.0}
    truth |= {"D_u": 56.24, "D_v": 53.05, "D_w": 95.0, "D_r": 26.07}
    file = load_vehicle(VEHICLE)
    answer = estimate(read_dive(shared("sealed", "open_1", "dive.tlog.gz")), file, "hovering", quiet)
    named = [name for name in truth if answer[name].identifiable]
    assert {"M_u", "M_v", "I_r", "D_u", "D_v", "D_w", "D_r"} <= set(named)
    for name in named:
        assert abs(answer[name].value - truth[name]) < 2.576 * answer[name].std, name
    assert answer.outcome is Outcome.CONVERGED


def test_thrusters_that_are_not_this_vehicles_make_data_and_model_disagree():
    dive = closed_loop.dive(np.random.default_rng(9), seconds=60.0)
    pulses = Signal(dive.tau_cmd.time_s, 1500 + 3 * dive.tau_cmd.value[:, :1])
    answer = fit(replace(dive, pwm=pulses))
    assert answer.outcome is Outcome.DISAGREES
    assert any("not this vehicle's" in note for note in answer.sentences)


def test_a_recording_of_another_configuration_makes_data_and_model_disagree():
    dive = closed_loop.dive(np.random.default_rng(9), seconds=60.0)
    other = Signal(np.array([0.0, 1.0]), np.array([[3.0], [3.0]]))
    answer = fit(replace(dive, veh_cfg=other))
    assert answer.outcome is Outcome.DISAGREES
    assert any("VEH_CFG 3" in note for note in answer.sentences)
