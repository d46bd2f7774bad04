"""The validation dives: what they ask for, and what the vehicle flies by."""

import math

import pytest

from bench.reproduce.dives import TURN_RAD, Trial, carrying, legs, without_inertia
from bridge.errors import ParamRejected
from bridge.parameters import bounds
from bridge.simulator.missions import Mission
from bridge.vehicle.coefficients import BY_NAME
from bridge.vehicle.config import load_vehicle
from bridge.vehicle.feedforward import Mode

FILE = load_vehicle("ruvifist")
VALUES = {"M_u": 96.4, "I_r": 22.5, "D_u": 42.13, "D_r": 21.8}


def test_the_linear_heading_ramps_from_7_to_22_s_as_in_fig_11():
    mission = Mission("turn", tuple(legs("heading, linear")))
    before, on, after = (mission.reference(t) for t in (6.99, 14.5, 22.01))
    assert before.heading_rad == 0.0
    assert on.heading_rad == pytest.approx(TURN_RAD / 2)
    assert on.nu_dot[5] == before.nu_dot[5] == 0.0
    assert after.heading_rad == pytest.approx(TURN_RAD)
    assert after.nu[5] == 0.0


def test_the_smooth_heading_has_the_acceleration_that_an_inertia_needs_and_the_same_turn():
    mission = Mission("turn", tuple(legs("heading, smooth")))
    assert mission.reference(9.5).nu_dot[5] > 0.0
    assert mission.reference(math.inf).heading_rad == pytest.approx(TURN_RAD)


def test_the_surge_trial_holds_the_top_speed_after_the_papers_transient():
    mission = Mission("line", tuple(legs("line")))
    assert mission.reference(4.0).nu[0] == 0.0
    assert mission.reference(9.01).nu[0] == mission.reference(28.99).nu[0] == 0.5


def test_what_was_identified_is_in_force_in_its_own_configuration_only():
    parameters = carrying(FILE, "hovering", VALUES)
    assert dict(parameters.active(1)) == pytest.approx(VALUES)
    assert "M_u" not in parameters.active(0)


def test_a_value_that_no_vehicle_can_have_is_refused_with_its_name():
    with pytest.raises(ParamRejected, match=r"M_u = 1 in survey \(OUT_OF_RANGE\)"):
        carrying(FILE, "survey", {**VALUES, "M_u": 1.0})


def test_without_inertia_means_the_least_that_the_parameters_take():
    least, _ = bounds(BY_NAME["I_r"], FILE.vehicle.configurations["survey"])
    found = without_inertia(VALUES, FILE, "survey")
    assert found == {**VALUES, "I_r": least}
    assert least < 0.1 * VALUES["I_r"]
    carrying(FILE, "survey", found)


def test_a_folder_does_not_name_its_mode_twice():
    trials = [
        Trial(name, "hovering", "line", Mode.ALONE, {}) for name in ("surge alone", "hovering alone ours")
    ]
    assert [trial.title for trial in trials] == ["surge", "hovering ours"]
