"""Effects that a crew accepted: what thrusters lose is asked for, what the hull needs is added, all else stays."""

import math
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from soak import rest_in_soak

from bridge.simulator.direct import simulate_truth
from bridge.simulator.missions import mission_named
from bridge.simulator.truth import Truth, load_truth
from bridge.vehicle.accepted_effects import Losses, Supply, VoltageLaw, known_effects
from bridge.vehicle.autopilot import Autopilot
from bridge.vehicle.coefficients import OF_ANY_VEHICLE, effect_coefficients
from bridge.vehicle.config import Configuration, Thruster, load_vehicle
from bridge.vehicle.feedforward import feedforward
from bridge.vehicle.mode import Mode
from bridge.vehicle.navigation import Navigation
from bridge.vehicle.references import Reference
from bridge.vehicle.thrusters import thrust_curve
from bridge.wire.status_codes import decoded

FILE = load_vehicle("ruvifist")
SHAPE = FILE.vehicle.configurations["hovering"]
CURVE = thrust_curve(FILE.vehicle.thrust_curve, FILE.path.parent)
MODEL = load_truth(FILE, "hovering").model
REACH = (100.0,) * 6
LIMITS = (-40.0, 40.0)
NOWHERE = np.zeros(8)
REFERENCE = Reference((0.4, -0.2, 0.1, 0.0, 0.0, 0.15), (0.1, 0.05, 0.2, 0.0, 0.0, -0.03), 0.0, 0.6)
LEVEL = Navigation((0.3, -0.1, 0.0), 0.0, (0.0, 0.0, 0.1), 0.0, (1.0, 0.0, 0.0, 0.0), 0.0, 0.0, 0.6, 0.0)


def losses(**given: float) -> Losses:
    return Losses(np.ones(8), **given)


def tick(coefficients: dict[str, float], mode: Mode, navigation: Navigation = LEVEL) -> np.ndarray:
    """The eleventh: what comes with the feed-forward is all there by then."""
    pilot = Autopilot(FILE.vehicle, "hovering", lambda _: coefficients, FILE.path.parent, mode)
    return np.array([pilot.step(0.05 * number, navigation, REFERENCE).pwm_us for number in range(11)][-1])


def test_every_id_fits_into_a_mavlink_parameter_and_none_is_given_twice():
    ids = [item.parameter_id(99) for item in OF_ANY_VEHICLE.values()]
    assert max(map(len, ids)) <= 16
    assert len(set(ids)) == len(ids)
    assert all(item.high <= OF_ANY_VEHICLE[item.name].high for item in effect_coefficients(SHAPE))


def test_the_wrench_gains_what_the_hull_needs_at_the_speed_that_is_wanted():
    hull = {
        "X_uu": 60.0,
        "Y_vv": 30.0,
        "N_rr": 5.0,
        "Y_r": 4.0,
        "N_v": -3.0,
        "Y_uv": 20.0,
        "N_uv": 8.0,
        "N_munk": 10.0,
    }
    plain, more = (feedforward(MODEL, REFERENCE, REACH, given).tau for given in ({}, hull))
    u, v, r = 0.4, -0.2, 0.15
    added = (
        60 * u * u,
        -30 * v * v + 4 * r + 20 * u * v,
        0,
        0,
        0,
        5 * r * r - 3 * v + 8 * u * v + 10 * u * v,
    )
    assert np.subtract(more, plain) == pytest.approx(added)
    assert feedforward(MODEL, REFERENCE, (12.0,) * 6, hull).tau[0] == 12.0


@pytest.mark.parametrize("mode", list(Mode))
def test_with_no_effect_in_force_the_pulses_are_to_the_last_bit_those_of_the_linear_model(mode):
    absent = dict.fromkeys(
        (effect_coefficient.name for effect_coefficient in effect_coefficients(SHAPE)), 0.0
    )
    assert known_effects(absent, SHAPE).losses is None
    np.testing.assert_array_equal(tick(MODEL | absent, mode), tick(MODEL, mode))
    linear = MODEL["M_u"] * 0.1 + MODEL["D_u"] * 0.4
    assert feedforward(MODEL, REFERENCE, REACH).tau[0] == linear


@pytest.mark.parametrize("mode", [Mode.OFF, Mode.SHADOW])
def test_where_the_feed_forward_is_not_applied_no_effect_changes_a_pulse(mode):
    effects = {"X_uu": 60.0, "T1_gain": 0.6, "T_start": 0.8, "T_astern": 0.7, "T_volt": 16.0, "T_vshare": 1.0}
    np.testing.assert_array_equal(tick(MODEL | effects, mode), tick(MODEL, mode))


def test_a_weak_thruster_is_asked_for_as_much_more_as_it_gives_less_and_the_others_for_the_same():
    before, after = (CURVE.thrust(tick(MODEL | more, Mode.ALONE)) for more in ({}, {"T2_gain": 0.8}))
    assert after[1] == pytest.approx(before[1] / 0.8)
    np.testing.assert_array_equal(np.delete(after, 1), np.delete(before, 1))


@given(
    thrust=st.lists(st.floats(-9, 9), min_size=8, max_size=8),
    gain=st.floats(0.7, 1.3),
    astern=st.floats(0.6, 1.2),
    start=st.floats(0, 3),
    ohm=st.floats(0, 0.05),
    supply=st.floats(0.8, 1.1),
)
@settings(max_examples=100)
def test_thrusters_give_what_was_wanted_of_what_they_are_asked_for(thrust, gain, astern, start, ohm, supply):
    worn = Losses(np.full(8, gain), astern, start, 0.0, ohm)
    wanted = np.array(thrust)
    asked, share = worn.made_up(wanted, supply, NOWHERE, LIMITS)
    assert share == 1.0
    # The sag of the supply is found in a few rounds; all else is exact.
    np.testing.assert_allclose(worn.given(asked, supply), wanted, rtol=2e-3 if ohm else 1e-12, atol=1e-12)


def test_a_thrust_below_the_least_one_becomes_the_nearer_of_nothing_and_the_least():
    asked, _ = losses(least_n=2.0).made_up(
        np.array([0.4, 0.9, 1.1, 1.9, 2.5, -1.2, 0.0, -0.3]), 1.0, NOWHERE, LIMITS
    )
    given_n = losses(least_n=2.0).given(asked)
    np.testing.assert_array_equal(given_n, [0.0, 0.0, 2.0, 2.0, 2.5, -2.0, 0.0, 0.0])


def test_about_zero_a_dead_zone_is_passed_without_a_jump():
    wanted = np.linspace(-1.0, 1.0, 8)
    gentle = np.full(8, 0.5)
    asked, _ = losses(start_n=2.0).made_up(wanted, 1.0, gentle, LIMITS)
    steep = 1.0 + 2.0 / 0.5
    assert np.all(np.diff(asked) <= steep * np.diff(wanted) + 1e-12)
    far = np.abs(wanted) >= 0.5
    np.testing.assert_allclose(losses(start_n=2.0).given(asked)[far], wanted[far])


def test_where_one_thruster_would_pass_its_limit_all_are_scaled_down_together():
    gain = np.ones(8)
    gain[2] = 0.5
    wanted = np.array([10.0, -10.0, 30.0, 5.0, 0.0, 0.0, 0.0, 0.0])
    worn = Losses(gain)
    asked, share = worn.made_up(wanted, 1.0, NOWHERE, LIMITS)
    assert asked[2] == pytest.approx(40.0)
    assert share == pytest.approx(20.0 / 30.0)
    np.testing.assert_allclose(worn.given(asked), share * wanted)


@given(
    st.dictionaries(
        st.sampled_from(sorted(coefficient.name for coefficient in effect_coefficients(SHAPE))), st.floats()
    ),
    st.floats(),
)
@settings(max_examples=100)
def test_whatever_coefficients_and_voltage_come_in_the_pulses_stay_within_the_limits(effects, voltage):
    pwm_us = tick(MODEL | effects, Mode.BOTH, replace(LEVEL, voltage_v=voltage))
    assert np.all(np.abs(CURVE.thrust(pwm_us)) <= 40.0 + 1e-9)


@pytest.mark.parametrize("value", [math.nan, math.inf, -1.0, 0.1, 50.0])
def test_a_coefficient_that_no_thruster_can_have_is_left_out_and_told_once(value):
    pilot, without = (
        Autopilot(FILE.vehicle, "hovering", lambda _, c=c: c, FILE.path.parent, Mode.ALONE)
        for c in (MODEL | {"T1_gain": value}, MODEL)
    )
    for number in range(3):
        actuation, wanted = (item.step(0.05 * number, LEVEL, REFERENCE) for item in (pilot, without))
    assert list(actuation.pwm_us) == pytest.approx(list(wanted.pwm_us))
    (text,) = (text for text in pilot.take_texts() if "FF without" in text)
    assert decoded(text).words.startswith("FF without T1_gain")
    assert len(text) <= 50


def test_raised_what_makes_up_for_losses_comes_over_half_a_second_and_goes_at_once():
    effects = {"T1_gain": 0.3, "T_start": 8.0, "T_ohm": 0.2}
    pilot = Autopilot(FILE.vehicle, "hovering", lambda _: MODEL | effects, FILE.path.parent, Mode.SHADOW)
    pushed = replace(REFERENCE, push=(20.0, 10.0, 0.0, 0.0, 0.0, 0.0))

    def pulses(number: int) -> np.ndarray:
        return np.array(pilot.step(0.05 * number, LEVEL, pushed).pwm_us)

    without = pulses(0)
    pilot.mode = Mode.ALONE
    raised = [pulses(number) for number in range(1, 13)]
    whole = raised[-1] - without
    assert np.abs(whole).max() > 100.0
    np.testing.assert_array_equal(raised[-1], raised[-2])
    for before, after in pairwise([without, *raised]):
        assert np.abs(after - before).max() < 0.3 * np.abs(whole).max()
    pilot.mode = Mode.OFF
    np.testing.assert_array_equal(pulses(13), without)


def test_a_battery_that_fell_is_made_up_for_by_the_square_of_its_voltage():
    law = {"T_volt": 16.0, "T_vshare": 1.0}
    fallen = replace(LEVEL, voltage_v=14.0)
    before, after = (CURVE.thrust(tick(MODEL | law, Mode.ALONE, n)) for n in (LEVEL, fallen))
    level = slice(0, 4)
    np.testing.assert_allclose(after[level], before[level] / (14.0 / 16.0) ** 2)


@pytest.mark.parametrize("voltage_v", [math.nan, 0.0, -16.0, 99.0, math.inf])
def test_a_voltage_that_is_not_there_or_absurd_counts_as_the_nominal_one(voltage_v):
    assert Supply().step(VoltageLaw(16.0, 1.0), voltage_v, 0.05) == 1.0


def test_a_voltage_that_falls_silent_fades_to_the_nominal_one_and_never_jumps():
    supply, law = Supply(), VoltageLaw(16.0, 1.0)
    factors = [supply.step(law, 14.0 if n < 10 else math.nan, 0.05) for n in range(4000)]
    assert factors[9] == pytest.approx((14 / 16) ** 2)
    assert max(np.diff(factors)) < 1e-3
    assert factors[-1] == pytest.approx(1.0, abs=1e-4)


def error_mm_s(coefficients: dict[str, float], truth: Truth) -> float:
    """Of the feed-forward alone over the validation mission in still water: surge and sway, root mean square."""
    mission = mission_named("validation", SHAPE)
    flown = simulate_truth(
        FILE, "hovering", mission, seed=100_001, parameters=coefficients, mode=Mode.ALONE, truth=truth
    )
    return 1e3 * float(np.sqrt(np.mean((flown.nu[:, :2] - flown.nu_ref[:, :2]) ** 2)))


PLANTED = {"X_uu": 60.0, "Y_vv": 90.0, "T_start": 0.8, "T2_gain": 0.75}


def test_with_its_effects_accepted_a_worn_vehicle_follows_as_well_as_one_without_any():
    calm = load_truth(FILE, "hovering").calm()
    worn = replace(calm, effects=PLANTED)
    as_built, before, after = (
        error_mm_s(MODEL, calm),
        error_mm_s(MODEL, worn),
        error_mm_s(MODEL | PLANTED, worn),
    )
    assert before > 50.0
    assert after < 3.0
    assert abs(after - as_built) < 0.1


@pytest.mark.parametrize("name", rest_in_soak(PLANTED))
def test_each_effect_alone_costs_tracking_and_is_made_up_for(name):
    calm = load_truth(FILE, "hovering").calm()
    worn = replace(calm, effects={name: PLANTED[name]})
    assert error_mm_s(MODEL, worn) > 15.0
    assert error_mm_s(MODEL | {name: PLANTED[name]}, worn) < 3.0


def test_each_effect_is_bounded_by_what_the_thrusters_of_its_vehicle_can_do():
    thrusters = (Thruster((1.0, 0.0, 0.0), (0.0, 0.0, 0.0)),) * 2
    of = {c.name: c for c in effect_coefficients(Configuration(10.0, (1.0, 2.0, 4.0), thrusters))}
    assert {name: c.high for name, c in of.items()} == pytest.approx({
        "X_uu": 2000.0, "Y_vv": 2000.0, "Z_ww": 2000.0, "K_pp": 8000.0, "M_qq": 8000.0, "N_rr": 8000.0,
        "Y_r": 800.0, "N_v": 400.0, "Y_uv": 2000.0, "N_uv": 2000.0, "N_munk": 2000.0, "S_x": 10.0, "S_y": 10.0,
        "T_astern": 2.0, "T_start": 10.0, "T_least": 10.0, "T_volt": 1000.0, "T_vshare": 2.0, "T_ohm": 1.0,
        "T1_gain": 2.0, "T2_gain": 2.0,
    })  # fmt: skip
    assert {name for name, c in of.items() if c.neutral == 1.0} == {"T_astern", "T1_gain", "T2_gain"}
    assert {c.neutral for c in of.values()} == {0.0, 1.0}
    low = [of[name].low for name in ("T_volt", "T1_gain", "T_start", "X_uu", "Y_uv")]
    assert low == pytest.approx([3.0, 0.3, 0.0, 0.0, -2000.0])
