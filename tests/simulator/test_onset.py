"""Effects that set in during a simulated dive, against exact answers."""

from dataclasses import replace

import numpy as np
import pytest
from test_plant import CURVE, MODEL, PUSH, STILL_WATER, plant, pwm

from bridge.errors import ConfigError
from bridge.simulator.onset import Sea
from bridge.simulator.plant import Plant
from bridge.simulator.truth import Truth

MASS = np.array([MODEL[name] for name in ("M_u", "M_v", "M_w", "I_p", "I_q", "I_r")])
DAMPING = np.array([MODEL[name] for name in ("D_u", "D_v", "D_w", "D_p", "D_q", "D_r")])
RIGID = np.array([72.0] * 3 + [1.0] * 3)


def with_onset(onset_s, **onset):
    return plant(truth=replace(STILL_WATER, onset=onset, onset_s=onset_s))


def driven(body, seconds, thrust_n=20.0):
    for _ in range(round(20 * seconds)):
        body.advance((pwm(thrust_n),), 0.05)
    return body.state[7:]


def test_until_then_the_dive_is_the_same_to_the_last_bit():
    calm, later = plant(), with_onset(5.0, T1_gain=0.5, current_n=0.1)
    np.testing.assert_array_equal(driven(calm, 5.0), driven(later, 5.0))
    assert driven(calm, 1.0)[0] != driven(later, 1.0)[0]


def test_a_fouled_propeller_ends_in_its_share_of_the_speed():
    assert driven(with_onset(10.0, T1_gain=0.5), 60.0)[0] == pytest.approx(0.5 * 20.0 / 50.0, rel=1e-6)


def test_a_propeller_that_fouls_turns_on_as_before():
    body = plant(truth=replace(STILL_WATER, onset={"T1_gain": 0.5}, onset_s=5.0), lag_s=0.5)
    driven(body, 5.0)
    fouled = body.advance((pwm(20.0),), 0.05)
    assert fouled.turned_n[0] == pytest.approx(20.0, rel=1e-3)
    assert fouled.thrust_n[0] < 19.5


def test_drag_that_sets_in_is_the_drag_from_then_on():
    speed = driven(with_onset(10.0, X_uu=100.0), 60.0)[0]
    assert 50.0 * speed + 100.0 * speed**2 == pytest.approx(20.0, rel=1e-6)


def test_a_vehicle_without_thrust_ends_up_drifting_with_the_current():
    nu = driven(with_onset(1.0, current_n=-0.2), 120.0, thrust_n=0.0)
    assert nu[:2] == pytest.approx([-0.2, 0.0], rel=1e-6)


def test_a_current_pushes_a_turning_body_by_the_inertia_of_its_added_mass_too():
    state = np.array([0, 0, 5.0, 1, 0, 0, 0, 0.2, 0.0, 0, 0, 0, 0.5])
    sea = Sea({"current_n": 0.2}, MASS, RIGID, np.zeros(6), np.zeros(6))
    # At rest in the water that carries it, a body that turns keeps its place in it: nothing pushes its added mass.
    push = sea.push(state, 0.0)
    added = MASS - RIGID
    assert push[0] == pytest.approx(0.0)
    assert push[1] == pytest.approx(-added[1] * 0.5 * 0.2 + added[0] * 0.2 * 0.5)


def test_a_tether_pulls_back_to_where_it_snagged():
    body = with_onset(5.0, tether=4.0)
    driven(body, 5.0)
    snagged_m = body.state[0]
    driven(body, 300.0)
    assert body.state[0] - snagged_m == pytest.approx(20.0 / 4.0, rel=1e-2)


def test_waves_carry_a_float_along_their_orbit_and_reach_no_deeper_than_they_are_long():
    """A body of the water's own density and no drag that rests in it moves as the water does: Airy's orbit."""
    sea = Sea({"wave_height": 0.4, "wave_period": 4.0}, MASS, RIGID, np.zeros(6), np.zeros(6))
    rate = 2 * np.pi / 4.0
    state = np.array([0, 0, 2.0, 1, 0, 0, 0, 0.0, 0, 0, 0, 0, 0])
    fast = 0.2 * rate * np.exp(-(rate**2) / 9.80665 * 2.0)
    for time_s in (0.0, 1.0, 2.5):
        water, _ = sea.water(state, time_s)
        np.testing.assert_allclose(water, [fast * np.cos(rate * time_s), 0, fast * np.sin(rate * time_s)])
        after, _ = sea.water(state, time_s + 1e-6)
        _, speeding = sea.water(state, time_s)
        np.testing.assert_allclose((after - water) / 1e-6, speeding, atol=1e-5)
        np.testing.assert_allclose(sea.push(state, time_s)[:3] / MASS[:3], speeding, atol=0.05)
    state[2] = 40.0
    assert np.abs(sea.push(state, 1.0)).max() < 0.01


@pytest.mark.parametrize(
    ("onset", "words"),
    [
        ({"wave_period": 0.0}, "wave_period"),
        ({"tide": 1.0}, "'tide' can't be simulated"),
        ({"X_uu": -1.0}, "X_uu"),
        ({"current_n": float("nan")}, "nan"),
        ({"current_n": 1e9}, r"current_n is 1e\+09; give -5 to 5"),
        ({"T60_gain": 3.0}, "T60_gain is 3; give 0 to 2"),
    ],
)
def test_an_onset_that_cannot_be_is_refused(onset, words):
    with pytest.raises(ValueError, match=words):
        Truth(MODEL, 0.0, 0.0, onset=onset)


def test_a_gain_out_of_bounds_is_refused_before_the_dive():
    with pytest.raises(ConfigError, match="T1_gain"):
        Plant(PUSH, CURVE, 0.0, replace(STILL_WATER, onset={"T1_gain": 0.01}), np.random.default_rng(0))
