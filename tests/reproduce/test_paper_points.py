"""The points at which the paper's numbers are checked: the arithmetic of each, and that it gives what it prints."""

import math
import re
from pathlib import Path

import numpy as np
import pytest
from fakes.shared import shared

from bench.reproduce import published
from bench.reproduce.measures import DOFS, demand, heading, matrices, span, steady_speed, turned
from bench.reproduce.paper import PaperNetwork
from bench.reproduce.points import (
    acceleration_error,
    checks,
    hotel_over_thrusters,
    lstm_weights,
    mass_left_out,
    points,
    propeller_power,
    steady_share,
)
from bench.reproduce.published import TABLE_3, TABLE_4, TABLE_5, Published
from bridge.errors import FitError
from bridge.simulator.truth import load_truth
from bridge.vehicle.config import load_vehicle
from bridge.vehicle.thrusters import thrust_curve
from identify.align import AlignedDive
from identify.dive import Dive, Signal

BY_TITLE = {point.title: point for point in points(72.0)}


def as_printed(number):
    """The ways in which the paper may write a number: 10 500, 62.30 %, 0.0080."""
    value = number.value
    forms = {
        f"{value:g}",
        f"{value:.1f}",
        f"{value:.2f}",
        f"{value:.4f}",
        f"{100 * value:.2f}",
        f"{100 * value:g}",
    }
    if value >= 1000:
        forms |= {f"{int(value):,}".replace(",", " "), f"{int(value)}"}
    return forms


@pytest.mark.parametrize(
    "number",
    [
        *(pytest.param(n, id=name) for name, n in vars(published).items() if isinstance(n, Published)),
        *(pytest.param(n, id=f"Table 3 {name}") for name, n in TABLE_3.items()),
        *(pytest.param(n, id=f"Table 4 {name}") for name, n in TABLE_4.items()),
    ],
)
def test_every_number_stands_in_the_paper(number):
    if number is published.RAMP:
        number = Published(22.0, "s", "the ramp's end; it begins at 7 s")
    text = shared("paper.txt").read_text(encoding="utf-8")
    assert any(re.search(rf"(?<![\d.]){re.escape(form)}(?!\d)", text) for form in as_printed(number))


def test_table_5_is_that_of_the_paper():
    text = shared("paper.txt").read_text(encoding="utf-8")
    for phase in ("Acceleration", "Steady state", "Deceleration", "Overall"):
        assert f"{phase}\t{TABLE_5['surge', phase]:.4f} m/s\t{TABLE_5['sway', phase]:.4f} m/s" in text


@pytest.mark.parametrize(("configuration", "table"), [("survey", TABLE_3), ("hovering", TABLE_4)])
def test_the_simulated_vehicle_is_what_the_tables_say_with_x_as_added_mass(configuration, table):
    file = load_vehicle("ruvifist")
    truth = load_truth(file, configuration).model
    dry = file.vehicle.configurations[configuration].dry_mass_kg
    true = {**truth, "X_udot": truth["M_u"] - dry, "Y_vdot": truth["M_v"] - dry}
    assert {name: true[name] for name in table} == pytest.approx({n: p.value for n, p in table.items()})


@pytest.mark.parametrize(
    ("title", "figure"),
    [
        ("X, added or total mass", "0.068 m/s"),
        ("Yaw inertia", "I_r = 21.8 kg m², or 15.3 kg m²"),
        ("2.40 N in surge", "11 % of it"),
        ("2.40 N in surge", "57 mm/s off"),
        ("1.7 N m in yaw", "74 % of the 2.3 N m of 90°"),
        ("Distance of the survey", "at most 327 m fit"),
        ("Distance of the survey", "1/0.5 + 1/0.4 + 1/0.3 + 1/0.2"),
        ("Power and thrust", "103 % more"),
        ("What the PID adds to the feed-forward", "would have to add 1.79 N"),
        ("The network's part", "38.3 million weights"),
    ],
)
def test_a_point_says_its_arithmetic(title, figure):
    assert figure in BY_TITLE[title].follows


def test_what_fits_fits_to_the_printed_digits():
    same = {check.what: (check.stated, check.computed) for check in checks()}
    for name in (
        "Rise of X_u",
        "Rise of D_u",
        "Eq. 17: 1.33 / cos 34°",
        "Fig. 15: target less settled speed",
    ):
        assert same[name][0] == same[name][1]


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


def test_the_steady_share_makes_the_overall_error_from_the_phases():
    share = steady_share(0.0091, 0.0036, 0.0048, 0.0051)
    moving = (1.0 - share) / 2.0
    assert moving * (0.0091 + 0.0048) + share * 0.0036 == pytest.approx(0.0051)


def test_the_weights_are_those_that_torch_counts():
    network = PaperNetwork(hidden=8, depth=3, dropout=0.0)
    assert lstm_weights(7, 8, 3, head=4, outputs=6) == sum(p.numel() for p in network.parameters())


MASS = np.array([[110.0, 3.0, -5.0], [3.0, 115.0, 8.0], [-5.0, 8.0, 16.0]])
DAMPING = np.array([[56.0, 4.0, 1.0], [-2.0, 53.0, 6.0], [0.5, -1.5, 26.0]])


def motion(seed, mass, damping, noise=0.0, moving=(1.0, 1.0, 1.0)):
    """A grid on which tau obeys the full model; sums of sines on each axis."""
    rng = np.random.default_rng(seed)
    time_s = np.arange(0.0, 600.0, 0.1)
    n = len(time_s)
    nu3, dot3 = np.zeros((n, 3)), np.zeros((n, 3))
    for axis, reach in enumerate(moving):
        for omega, phase in zip(rng.uniform(0.05, 0.8, 4), rng.uniform(0, 6.28, 4), strict=True):
            nu3[:, axis] += 0.1 * reach * np.sin(omega * time_s + phase)
            dot3[:, axis] += 0.1 * reach * omega * np.cos(omega * time_s + phase)
    momentum = nu3 @ mass
    u, v, r = nu3.T
    coriolis = np.column_stack(
        (-r * momentum[:, 1], r * momentum[:, 0], u * momentum[:, 1] - v * momentum[:, 0])
    )
    tau3 = dot3 @ mass + coriolis + nu3 @ damping.T + noise * rng.standard_normal((n, 3))
    nu, nu_dot, tau = (np.zeros((n, 6)) for _ in range(3))
    nu[:, DOFS], nu_dot[:, DOFS], tau[:, DOFS] = nu3, dot3, tau3
    attitude = np.tile([1.0, 0.0, 0.0, 0.0], (n, 1))
    return AlignedDive(time_s, nu, nu_dot, tau, attitude, np.ones(n, np.bool_), np.ones(6, np.bool_))


def test_exact_data_give_both_matrices_exactly():
    results = {term.name: term.value for term in matrices(motion(1, MASS, DAMPING))}
    letters = "uvr"
    for i in range(3):
        for j in range(3):
            assert results[f"D_{letters[i]}{letters[j]}"] == pytest.approx(DAMPING[i, j], abs=1e-6)
            if i <= j:
                assert results[f"M_{letters[i]}{letters[j]}"] == pytest.approx(MASS[i, j], abs=1e-6)


def test_nothing_off_the_diagonal_is_found_within_its_errors():
    inside = []
    for seed in range(5):
        terms = matrices(motion(seed, np.diag(np.diag(MASS)), np.diag(np.diag(DAMPING)), noise=1.0))
        inside += [abs(t.value) < 1.96 * t.std for t in terms if not t.diagonal]
    assert len(inside) == 45
    assert np.mean(inside) > 0.85


def test_a_share_is_taken_of_the_diagonal_neighbours():
    term = next(t for t in matrices(motion(2, MASS, DAMPING)) if t.name == "D_vr")
    assert term.share == pytest.approx(6.0 / np.sqrt(53.0 * 26.0), abs=1e-6)


def test_a_dive_without_sway_is_refused():
    with pytest.raises(FitError, match="surge, sway and yaw"):
        matrices(motion(3, MASS, DAMPING, moving=(1.0, 0.0, 1.0)))


RATE = math.radians(12)


def turning(lag_s=0.0, past_rad=0.0, way=1.0, offset=0.0):
    """A ramp of 15 s from 7 s on, followed `lag_s` later and past its end at last."""
    time_s = np.arange(0.0, 32.0, 0.05)
    n = len(time_s)
    wanted = way * RATE * np.clip(time_s - 7.0, 0.0, 15.0)
    yaw = way * RATE * np.clip(time_s - 7.0 - lag_s, 0.0, 15.0) + way * past_rad * (time_s > 26.0) + offset
    reference = np.zeros((n, 14))
    reference[:, 5] = way * RATE * ((time_s >= 7.0) & (time_s < 22.0))
    reference[:, 12] = wanted
    attitude = np.column_stack((np.cos(yaw / 2), np.zeros(n), np.zeros(n), np.sin(yaw / 2)))
    return Dive(
        "turn", Path("turn.tlog"), "", attitude=Signal(time_s, attitude), nu_ref=Signal(time_s, reference)
    )


@pytest.mark.parametrize("way", [1.0, -1.0])
@pytest.mark.parametrize("offset", [0.0, math.tau])
def test_a_heading_that_trails_a_ramp_lags_by_the_seconds_that_it_trails(way, offset):
    result = turned(turning(lag_s=1.0, way=way, offset=offset))
    assert result.lag_s == pytest.approx(1.0, abs=1e-6)
    assert result.overshoot_deg == pytest.approx(0.0, abs=1e-6)


@pytest.mark.parametrize("way", [1.0, -1.0])
def test_a_heading_past_the_end_of_a_turn_overshoots_by_that_angle(way):
    assert turned(turning(past_rad=0.1, way=way)).overshoot_deg == pytest.approx(math.degrees(0.1))


def test_a_heading_over_south_is_no_jump():
    measured, wanted = heading(turning(lag_s=0.5))
    assert np.abs(np.diff(measured.value[:, 0])).max() < 0.02
    assert measured.value[-1, 0] == pytest.approx(wanted.value[-1, 0])


def surging(speed=0.2):
    """20 s at a speed, with 1 s of change before and after; every thruster at 1600 us while steady."""
    time_s = np.arange(0.0, 30.0, 0.05)
    n = len(time_s)
    reference = np.zeros((n, 14))
    reference[:, 0] = np.interp(time_s, [4.0, 5.0, 25.0, 26.0], [0.0, speed, speed, 0.0])
    reference[:, 6] = np.gradient(reference[:, 0], time_s)
    velocity = np.zeros((n, 3))
    velocity[:, 0] = 0.9 * reference[:, 0]
    steady = (time_s > 5.2) & (time_s < 24.8)
    pwm = np.where(steady, 1600.0, 1700.0)[:, None] * np.ones(8)
    return Dive(
        "surge",
        Path("surge.tlog"),
        "",
        velocity=Signal(time_s, velocity),
        nu_ref=Signal(time_s, reference),
        pwm=Signal(time_s[steady], pwm[steady]),
    )


def test_the_settled_speed_is_that_of_the_steady_phase():
    assert steady_speed(surging(), 0) == pytest.approx(0.18)


def test_a_motion_lasts_from_its_first_to_its_last_moment():
    assert span(surging(), 0) == pytest.approx((4.0, 26.0), abs=0.1)


def test_the_demand_is_of_the_four_thrusters_that_push_along():
    file = load_vehicle("ruvifist")
    each = float(thrust_curve(file.vehicle.thrust_curve, file.path.parent).thrust(1600.0))
    result = demand(surging(), file, "survey", 0.2)
    assert result.thrust_n == pytest.approx(4 * each)
    assert result.ideal_power == pytest.approx(4 * each**1.5)
