"""The planting simulator against answers that are known exactly."""

import math

import numpy as np
import pytest

from identify.challenge.equations_of_motion import STATES, WORK, body, solve6, state_derivative
from identify.challenge.hull import Propellers, add_wrench, bare_hull, growth, shafts_want, turn


def full_mass(rng):
    """A symmetric positive 6 x 6 matrix with everything off its diagonal."""
    half = rng.standard_normal((6, 6))
    return half @ half.T + 6 * np.eye(6)


def floating(rigid, added, damping, weight_n=0.0, low_m=0.0):
    return body(rigid, added, damping, np.array([0.0, 0.0, low_m]), weight_n, 0.0, 0.0)


def slope_of(solid, state, tau=None, water=None, hull=None):
    """The state's time derivative (STATES,), without a wrench in still water far from the bottom unless told."""
    slope, tau = np.empty(STATES), np.zeros(6) if tau is None else tau
    water, hull = np.zeros(12) if water is None else water, bare_hull(1e3) if hull is None else hull
    state_derivative(state, tau, water, 0.0, solid, hull, 0.0, 0.0, slope, np.empty(WORK))
    return slope


def moved(solid, start, tau, seconds, step_s, water=None, hull=None):
    """States (n, STATES) by fourth-order Runge-Kutta under a constant wrench."""
    out = [start]
    for _ in range(round(seconds / step_s)):
        slopes, state = [], out[-1]
        for share in (0.0, 0.5, 0.5, 1.0):
            trial = state + share * step_s * slopes[-1] if slopes else state
            slopes.append(slope_of(solid, trial, tau, water, hull))
        out.append(state + step_s / 6 * (slopes[0] + 2 * slopes[1] + 2 * slopes[2] + slopes[3]))
    return np.array(out)


def level(**nu):
    state = np.zeros(STATES)
    state[3] = 1.0
    for name, value in nu.items():
        state[7 + "uvwpqr".index(name)] = value
    return state


def test_energy_is_kept_without_forces():
    rng = np.random.default_rng(2)
    rigid, added = full_mass(rng), 0.5 * full_mass(rng)
    start = level(u=0.5, v=-0.3, w=0.2, p=0.4, q=-0.5, r=0.6)
    nu = moved(floating(rigid, added, np.zeros((6, 6))), start, np.zeros(6), 20.0, 0.01)[:, 7:13]
    energy = 0.5 * np.einsum("ni,ij,nj->n", nu, rigid + added, nu)
    assert np.ptp(nu, axis=0).min() > 0.05
    assert energy == pytest.approx(np.full(len(nu), energy[0]), rel=1e-8)


def test_momentum_over_ground_is_kept_without_forces():
    rng = np.random.default_rng(3)
    mass = full_mass(rng)
    states = moved(
        floating(mass, np.zeros((6, 6)), np.zeros((6, 6))),
        level(u=0.5, q=0.3, r=0.6),
        np.zeros(6),
        10.0,
        0.01,
    )
    w, x, y, z = states[-1, 3:7] / np.linalg.norm(states[-1, 3:7])
    rotation = np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )
    before, after = (mass @ states[i, 7:13] for i in (0, -1))
    assert rotation @ after[:3] == pytest.approx(before[:3], abs=1e-7)


def test_a_constant_push_comes_to_the_push_over_the_damping():
    solid = floating(np.diag([70.0] * 6), np.diag([30.0] * 6), np.diag([50.0, 60.0, 90.0, 20.0, 20.0, 20.0]))
    states = moved(solid, level(), np.array([20.0, 0, 0, 0, 0, 0]), 60.0, 0.05)
    assert states[-1, 7] == pytest.approx(20.0 / 50.0, rel=1e-9)
    after_s = 100.0 / 50.0
    assert states[round(after_s / 0.05), 7] == pytest.approx(0.4 * (1 - math.exp(-1)), rel=1e-6)


def test_it_rolls_with_the_period_of_a_pendulum():
    weight_n, low_m, inertia = 700.0, 0.05, 5.0
    solid = floating(np.diag([70.0] * 3 + [inertia] * 3), np.zeros((6, 6)), np.zeros((6, 6)), weight_n, low_m)
    start = level()
    start[3], start[4] = math.cos(0.005), math.sin(0.005)
    period_s = 2 * math.pi * math.sqrt(inertia / (weight_n * low_m))
    roll = moved(solid, start, np.zeros(6), period_s, period_s / 500)[:, 4]
    assert roll[-1] == pytest.approx(roll[0], rel=1e-3)
    assert roll[250] == pytest.approx(-roll[0], rel=1e-3)


def test_a_free_body_drifts_with_the_current():
    solid = floating(np.diag([70.0] * 6), np.diag([30.0] * 6), np.diag([50.0] * 6))
    water = np.zeros(12)
    water[:3] = 0.2, -0.1, 0.0
    start = level()
    start[3], start[6] = math.cos(0.4), math.sin(0.4)
    last = moved(solid, start, np.zeros(6), 60.0, 0.05, water)[-1]
    over_ground = (last[:3] - moved(solid, start, np.zeros(6), 59.0, 0.05, water)[-1][:3]) / 1.0
    assert over_ground == pytest.approx([0.2, -0.1, 0.0], abs=1e-6)


@pytest.mark.parametrize("hull", [bare_hull(1e3), bare_hull(0.4)._replace(bottom=0.5)])
def test_water_that_speeds_up_carries_a_body_and_the_mass_that_a_boundary_adds_along(hull):
    added = np.diag([30.0, 50.0, 60.0, 1.0, 1.0, 1.0])
    solid = body(np.diag([70.0] * 6), added, np.zeros((6, 6)), np.zeros(3), 0.0, 0.0, 70.0)
    water = np.zeros(12)
    water[3:6] = 0.3, -0.2, 0.1
    assert slope_of(solid, level(), water=water, hull=hull)[7:10] == pytest.approx([0.3, -0.2, 0.1])


def test_planted_drag_has_its_own_power():
    solid = floating(np.eye(6), np.zeros((6, 6)), np.zeros((6, 6)))
    hull = bare_hull(1e3)._replace(drag=np.array([7.0, 0, 0, 0, 0, 0]))
    for u in (-0.4, 0.4):
        assert slope_of(solid, level(u=u), hull=hull)[7] == pytest.approx(-7.0 * math.copysign(0.4**1.8, u))


@pytest.mark.parametrize(
    ("hidden", "u", "slowed_n"),
    [
        ({"drag": 7.0 * np.eye(6)[0], "astern": 0.5}, -0.4, -1.5 * 7.0 * 0.4**1.8),
        ({"drag": 7.0 * np.eye(6)[0], "astern": 0.5}, 0.4, 7.0 * 0.4**1.8),
        # Where it drags, the chain's friction is all there but at a crawl.
        ({"floor_m": 0.9, "chain_m": 1.0, "chain_n": 5.0}, 0.4, 5.0 * 0.4 / 0.41),
        ({"floor_m": 1.1, "chain_m": 1.0, "chain_n": 5.0}, 0.4, 0.0),
    ],
)
def test_drag_that_is_larger_astern_and_a_chain_that_drags_on_the_bottom_slow_the_surge(hidden, u, slowed_n):
    solid = floating(np.eye(6), np.zeros((6, 6)), np.zeros((6, 6)))
    slope = slope_of(solid, level(u=u), hull=bare_hull(1e3)._replace(**hidden))
    assert slope[7] == pytest.approx(-slowed_n, rel=1e-6)


def test_a_heavier_added_mass_near_the_surface_slows_the_same_push():
    solid = floating(np.diag([70.0] * 6), np.diag([30.0] * 6), np.zeros((6, 6)))
    hull = bare_hull(1e3)._replace(surface=0.5, surface_m=0.5)
    slope = slope_of(solid, level(), tau=np.array([0, 10.0, 0, 0, 0, 0]), hull=hull)
    assert slope[8] == pytest.approx(10.0 / (100.0 + 0.5 * 30.0))


@pytest.mark.parametrize("which", ["surface", "bottom"])
def test_a_boundary_neither_gives_nor_takes_energy(which):
    """A body that tumbles beside it keeps its energy and its water's, though its added mass changes by half."""
    rigid, added = np.diag([70.0, 70.0, 70.0, 8.0, 11.0, 15.0]), np.diag([30.0, 60.0, 80.0, 3.0, 4.0, 5.0])
    hull = bare_hull(2.0)._replace(**{which: 0.9})
    start = level(u=0.3, v=0.25, w=0.2 if which == "bottom" else -0.2, p=0.1, q=-0.2, r=0.4)
    start[2] = 1.2 if which == "bottom" else 1.6
    states = moved(floating(rigid, added, np.zeros((6, 6))), start, np.zeros(6), 6.0, 0.005, hull=hull)
    shares = np.array([growth(depth, hull)[0] for depth in states[:, 2]])
    mass = np.diag(rigid + added) + shares[:, None] * hull.near_share * np.diag(added)
    energy = 0.5 * (mass * states[:, 7:13] ** 2).sum(axis=1)
    assert np.ptp(shares) > 0.25
    assert energy == pytest.approx(energy[0], rel=1e-8)


def test_the_hand_written_solver_solves():
    rng = np.random.default_rng(4)
    matrix, right = full_mass(rng), rng.standard_normal(6)
    answer = right.copy()
    solve6(matrix.copy(), answer)
    assert matrix @ answer == pytest.approx(right)


def propellers(**hidden):
    return Propellers(
        np.array([[1.0, 0.0, 0.0]]), np.zeros((1, 3)), np.ones(1), np.zeros(4), np.zeros(1), 0.03, 40.0
    )._replace(**hidden)


def test_the_dead_zone_is_soft_inside_and_takes_its_width_outside():
    out = np.empty(1)
    for asked, given in ((20.0, 19.2), (-20.0, -19.2), (0.0, 0.0)):
        shafts_want(np.array([asked]), 0.0, False, propellers(dead_n=0.8), np.zeros((2, 1)), 0.0, out)
        assert out[0] == pytest.approx(given, abs=1e-9)
    shafts_want(np.array([0.4]), 0.0, False, propellers(dead_n=0.8), np.zeros((2, 1)), 0.0, out)
    assert 0.0 < out[0] < 0.05


def test_two_lags_in_a_row_delay_a_ramp_by_their_sum():
    first, second, half_s = np.zeros(1), np.zeros(1), 0.0005
    keep = math.exp(-half_s / 0.1)
    for i in range(8000):
        turn(np.array([i * half_s]), first, second, keep, keep)
    assert 8000 * half_s - second[0] == pytest.approx(0.2, abs=0.002)


def test_water_that_comes_at_a_thruster_takes_thrust_by_the_speed_of_its_place_as_the_vehicle_turns():
    place, nu = np.array([0.3, -0.2, 0.1]), np.array([0.5, -0.3, 0.2, 0.4, -0.6, 0.8])
    for way in np.eye(3):
        out = np.zeros(6)
        one = propellers(way=way[None], place=place[None], inflow=0.7)
        add_wrench(np.array([9.0]), nu, one, out)
        thrust = 9.0 - 0.7 * 3.0 * way @ (nu[:3] + np.cross(nu[3:], place))
        assert out == pytest.approx(thrust * np.concatenate([way, np.cross(place, way)]))
