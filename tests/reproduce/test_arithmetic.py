"""What follows from the paper's own numbers, against exact answers."""

import math

import numpy as np
import pytest

from bench.reproduce.paper import PaperNetwork
from bench.reproduce.points import (
    acceleration_error,
    hotel_over_thrusters,
    longest_distance,
    lstm_weights,
    mass_left_out,
    propeller_power,
    steady_share,
)


def test_four_laps_in_1050_s_make_at_most_327_m():
    assert longest_distance(10_500, 10.0, (0.5, 0.4, 0.3, 0.2)) == pytest.approx(4 * 1050 / (77 / 6))


def test_a_feed_forward_with_the_whole_mass_makes_no_error_while_speeding_up():
    assert acceleration_error(0.0, 40.0, 56.0, 0.4, 5.0) == 0.0


def test_a_long_transient_makes_the_error_that_missing_mass_has_in_steady_acceleration():
    # Mean acceleration 0.4 / T; of a slow vehicle against a long transient only missing * a / D is left.
    error = acceleration_error(10.0, 1.0, 500.0, 0.4, 50.0)
    assert error == pytest.approx(10.0 * (0.4 / 50.0) / 500.0, rel=0.01)


@pytest.mark.parametrize("missing", [0.5, 6.0, 72.0])
def test_the_mass_left_out_is_found_again_from_the_error_that_it_makes(missing):
    error = acceleration_error(missing, 39.6, 56.24, 0.4, 5.0)
    assert mass_left_out(error, 39.6, 56.24, 0.4, 5.0) == pytest.approx(missing, rel=1e-6)


def test_the_hotel_load_makes_the_ratio_of_all_power_from_that_of_the_thrusters():
    hotel = hotel_over_thrusters(1.55, 2.03)
    assert (hotel + 2.03) / (hotel + 1.0) == pytest.approx(1.55)


def test_an_ideal_propeller_at_rest_needs_power_with_thrust_to_the_power_one_and_a_half():
    assert propeller_power(2.0, 0.0, 0.0045) / propeller_power(1.0, 0.0, 0.0045) == pytest.approx(2.0**1.5)


def test_an_ideal_propeller_at_speed_needs_little_more_than_thrust_times_speed():
    assert propeller_power(1.0, 50.0, 0.0045) == pytest.approx(50.0, rel=1e-3)


def test_the_steady_share_makes_the_overall_error_from_the_phases():
    share = steady_share(0.0091, 0.0036, 0.0048, 0.0051)
    moving = (1.0 - share) / 2.0
    assert moving * (0.0091 + 0.0048) + share * 0.0036 == pytest.approx(0.0051)


def test_the_weights_are_those_that_torch_counts():
    network = PaperNetwork(hidden=8, depth=3, dropout=0.0)
    assert lstm_weights(7, 8, 3, head=4, outputs=6) == sum(p.numel() for p in network.parameters())


@pytest.mark.parametrize("inertia", [1.0, 22.0, 300.0])
@pytest.mark.parametrize("drag_ratio", [1.0, 1.2])
def test_a_turn_without_inertia_in_its_feed_forward_ends_at_the_ratio_of_the_dampings(inertia, drag_ratio):
    # I r_dot + D r = D' r_d, integrated exactly over 15 s of ramp, then coasting for long.
    damping, rate = 21.8, math.radians(12)
    settled = drag_ratio * rate
    tau_s = inertia / damping
    ramp_s = 15.0
    turned = settled * (ramp_s - tau_s * (1 - np.exp(-ramp_s / tau_s)))
    coasted = settled * (1 - np.exp(-ramp_s / tau_s)) * tau_s
    assert turned + coasted == pytest.approx(drag_ratio * rate * ramp_s)
