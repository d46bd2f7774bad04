"""The recorded velocity is held against what the controller did, and against what it says that it used."""

from dataclasses import replace

import closed_loop
import numpy as np
import pytest
from fakes.shared import shared

from bench.diagnosis.trials import recorded_dive
from bench.missions.mission import draw_one
from bridge.vehicle.config import Water
from identify.challenge.case import draw_case
from identify.checks.actuation.controller import fed_velocity, feedback_doubts, stamp_doubts
from identify.dive import Signal
from identify.doubt import Outcome
from identify.estimators.likelihood.answer import estimate
from identify.estimators.table import judged
from identify.ingest.open import read_dive


def dive(seed=100_001, **keys):
    return closed_loop.dive(np.random.default_rng(seed), seconds=120.0, **keys)


def with_nu_fb(recorded, surge):
    six = recorded.nu_fb.value.copy()
    six[:, 0] = surge
    return replace(recorded, nu_fb=Signal(recorded.nu_fb.time_s, six))


def test_a_controller_that_used_what_was_recorded_raises_no_doubt():
    assert feedback_doubts(dive(), Water()) == ()


def test_an_attitude_whose_stamp_was_rounded_past_the_wrench_that_it_led_to_raises_no_doubt():
    case = draw_case(
        391_200_0003, kind="none"
    )  # its controller runs at 13 Hz: two of three stamps are rounded
    recorded = recorded_dive(case)
    assert np.any(recorded.attitude.time_s != np.round(recorded.attitude.time_s * 26) / 26)
    assert feedback_doubts(recorded, case.file.vehicle.water) == ()


def test_a_wrench_that_follows_from_nothing_recorded_is_doubted_with_what_to_do():
    (doubt,) = feedback_doubts(dive(hidden_noise=0.02), Water())
    assert doubt.about == ("M_u",)
    assert "In surge 6" in doubt.sentence
    assert "of the controller's wrench (TAU_PID) follows from nothing recorded" in doubt.sentence
    assert (
        "so M_u is left out, and the true D_u may lie below its value; record the very velocity"
        in doubt.sentence
    )


def test_a_fed_back_velocity_of_another_sensor_is_told_by_its_own_noise():
    recorded = dive()
    truth = np.convolve(recorded.velocity.value[:, 0], np.ones(7) / 7, "same")
    other = truth + 0.006 * np.random.default_rng(100_002).normal(size=len(truth))
    assert fed_velocity(with_nu_fb(recorded, other), 0).left > 0.9


@pytest.mark.parametrize("weight", [0.2, 0.5, 1.0])
def test_a_causal_filter_of_the_recorded_velocity_is_the_recorded_velocity(weight):
    recorded = dive()
    filtered = recorded.velocity.value[:, 0].copy()
    for k in range(1, len(filtered)):
        filtered[k] = filtered[k - 1] + weight * (filtered[k] - filtered[k - 1])
    assert fed_velocity(with_nu_fb(recorded, filtered), 0).left < 0.3


def test_no_further_delay_is_tried_once_one_explains_enough():
    recorded = dive()
    noisy = recorded.velocity.value[:, 0] + np.random.default_rng(0).normal(
        0.0, 0.002, len(recorded.velocity.value)
    )
    best, first = (fed_velocity(with_nu_fb(recorded, noisy), 0, enough) for enough in (0.0, 10.0))
    assert first.late_s == 0.0
    assert best.left <= first.left < 10.0


def test_a_velocity_carried_to_the_origin_by_the_gyro_is_the_recorded_one():
    recorded = dive()
    turning = 0.2 * np.sin(0.5 * recorded.velocity.time_s)
    gyro = np.column_stack([0 * turning, 0 * turning, turning])
    at_transducer = recorded.velocity.value[:, 0]
    carried = replace(
        with_nu_fb(recorded, at_transducer + 0.3 * turning), gyro=Signal(recorded.velocity.time_s, gyro)
    )
    assert fed_velocity(carried, 0).left < 0.1


def test_a_velocity_that_was_used_before_its_stamp_tells_how_late_the_stamps_are():
    mission = draw_one(100_301, seconds=120.0)
    assert stamp_doubts(mission.dive) == ()
    read = mission.dive.velocity
    late = replace(mission.dive, velocity=Signal(read.time_s + 0.1, read.value))
    (doubt,) = stamp_doubts(late)
    assert doubt.about == ("M_u", "M_v", "M_w", "D_u", "D_v", "D_w")
    assert doubt.outcome is Outcome.DISAGREES
    assert "(NU_FB) some 100 ms before the recording says that they were read" in doubt.sentence
    assert feedback_doubts(late, Water()) == ()


def test_a_recording_without_the_controllers_own_signals_is_not_judged():
    bare = replace(dive(hidden_noise=0.02), nu_fb=None)
    assert feedback_doubts(bare, Water()) == ()


def test_a_method_that_does_not_ask_loses_the_mass_that_the_feedback_spoils():
    recorded = dive(hidden_noise=0.02)
    other = judged(lambda *asked: replace(estimate(*asked), doubts=(), weighed_by_others=None))
    answer = other(recorded, closed_loop.vehicle_file(), "only", lambda *_: None)
    assert any("so M_u is left out" in sentence for sentence in answer.sentences)
    assert not answer["M_u"].identifiable
    assert not answer["X_udot"].identifiable
    assert answer["M_u"].reason.endswith("wrench (TAU_PID) follows from nothing recorded")
    assert answer["D_u"].identifiable
    assert "M_u" not in answer.covariance_of


@pytest.mark.parametrize("name", ["open_1", "b", "g"])
def test_dives_made_elsewhere_raise_no_doubt_but_in_heave_whose_depth_they_keep_to_themselves(name):
    doubts = feedback_doubts(read_dive(shared("sealed", name, "dive.tlog.gz")), Water())
    assert [doubt.about for doubt in doubts] == [("M_w",)]


def test_a_controller_that_a_push_relieves_raises_no_doubt():
    """Its wrench is nothing but for two seconds in ten: no reading explains when it was let at the thrusters."""
    recorded = dive()
    six = recorded.tau_pid.value.copy()
    six[np.mod(recorded.tau_pid.time_s, 10.0) > 2.0] = 0.0
    pushed = replace(recorded, tau_pid=Signal(recorded.tau_pid.time_s, six))
    assert feedback_doubts(pushed, Water()) == ()
