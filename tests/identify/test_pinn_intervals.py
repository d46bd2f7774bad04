"""Readings in the network's intervals: a path between two instants is read exactly, increments whole or not at all."""

import numpy as np
import pytest
from network_tasks import read_by

from identify.estimators.innovations import INCREMENT, POSITION, VELOCITY
from identify.estimators.pinn.layout import instants, readings_in

NODES = np.array([0.0, 0.1, 0.2, 0.35, 0.45])
NU = np.array([0.2, 0.5, -0.1, 0.0, 0.3])
"""Velocity at the nodes; straight lines between them."""

STATE = np.column_stack([NU, np.zeros(5), np.zeros(5)])
STATE[1:, 2] = np.cumsum(0.5 * (NU[1:] + NU[:-1]) * np.diff(NODES))
"""(nu, d, x) at the nodes."""


def said(found):
    """What the network at STATE would have read, (N,)."""
    return np.sum(found.before * STATE[:-1] + found.after * STATE[1:], axis=1)


def readings(axis, nodes=NODES):
    return readings_in(axis, 0, nodes, 3, 0, 2)


TIMES = np.array([0.0, 0.03, 0.07, 0.1, 0.25, 0.41, 0.45])


def test_a_velocity_on_a_straight_line_is_read_exactly():
    found = readings(read_by(VELOCITY, TIMES, np.interp(TIMES, NODES, NU)))
    known = np.isfinite(found.value)
    assert known.tolist() == [True, True, True, True]
    np.testing.assert_allclose(said(found)[known], found.value[known], atol=1e-14)


def test_readings_of_one_interval_become_their_mean_with_the_noise_of_a_mean():
    found = readings(read_by(VELOCITY, TIMES, np.interp(TIMES, NODES, NU), scale=2.0 * np.ones(7)))
    assert found.value[0] == pytest.approx(np.mean(np.interp(TIMES[:3], NODES, NU)))
    assert found.scale[0] == pytest.approx(2.0 / np.sqrt(3))
    assert found.scale[2] == pytest.approx(2.0)


def test_the_integral_of_a_straight_line_is_read_exactly():
    fine = np.linspace(0.0, 0.45, 4501)
    slow = np.concatenate(
        [[0.0], np.cumsum(0.5 * (np.interp(fine[1:], NODES, NU) + np.interp(fine[:-1], NODES, NU)))]
    )
    found = readings(read_by(POSITION, TIMES, np.interp(TIMES, fine, slow * 1e-4)))
    np.testing.assert_allclose(said(found), found.value, atol=1e-12)


def test_an_increment_is_the_integral_of_the_velocity():
    value = np.diff(STATE[:, 2])
    found = readings(read_by(INCREMENT, NODES[1:], value, scale=np.diff(NODES)))
    np.testing.assert_allclose(found.value, value)
    np.testing.assert_allclose(said(found), value, atol=1e-14)
    np.testing.assert_allclose(found.scale, np.diff(NODES))


def test_increments_of_one_interval_add_up():
    ends = np.array([0.05, 0.1, 0.15, 0.2])
    value = np.array([0.01, 0.02, 0.03, -0.01])
    found = readings(read_by(INCREMENT, ends, value, scale=np.full(4, 0.05)), NODES[:3])
    np.testing.assert_allclose(found.value, [0.03, 0.02])
    np.testing.assert_allclose(found.scale, np.sqrt(2 * 0.05**2))
    np.testing.assert_allclose(found.before[:, 0], 0.05)


def test_an_interval_that_increments_do_not_fill_is_left_out():
    ends = np.array([0.05, 0.1, 0.15])
    found = readings(read_by(INCREMENT, ends, np.full(3, 0.01), scale=np.full(3, 0.05)), NODES[:3])
    assert np.isfinite(found.value).tolist() == [True, False]


def test_a_reading_that_is_not_known_is_none():
    found = readings(read_by(VELOCITY, TIMES, np.where(TIMES < 0.2, np.nan, 1.0)))
    assert np.isfinite(found.value).tolist() == [False, False, True, True]


def under_thrust(s, h, halves, d, mass):
    """How far the velocity is off the straight line between both ends, by integrating force over mass."""
    fine = np.linspace(0.0, 1.0, 20001)
    force = np.where(fine < 0.5, *halves) + d[0] + (d[1] - d[0]) * fine
    middle = 0.5 * (force[1:] + force[:-1])
    nu = np.concatenate([[0.0], np.cumsum(middle) * h * (fine[1] - fine[0]) / mass])
    return np.interp(s, fine, nu - nu[-1] * fine)


@pytest.mark.parametrize("s", [0.1, 0.5, 0.8])
@pytest.mark.parametrize(
    ("halves", "d"), [((30.0, -10.0), (0.0, 0.0)), ((0.0, 0.0), (4.0, -1.0)), ((9.0, 2.0), (3.0, 1.0))]
)
def test_a_velocity_swings_under_the_thrust_and_bends_under_the_disturbance(s, halves, d):
    h, mass = 0.1, 50.0
    found = readings(read_by(VELOCITY, [s * h], [0.0]), np.array([0.0, h]))
    swing = 0.25 * h * (halves[0] - halves[1])
    off = (found.swung[0] * swing + found.bent[0] * (d[0] - d[1])) / mass
    assert off == pytest.approx(under_thrust(s, h, halves, d, mass), abs=1e-5)


@pytest.mark.parametrize(("halves", "d"), [((30.0, -10.0), (0.0, 0.0)), ((0.0, 0.0), (4.0, -1.0))])
def test_an_increment_holds_the_integral_of_swing_and_bend(halves, d):
    h, mass = 0.1, 50.0
    found = readings(read_by(INCREMENT, [h], [0.0], scale=[h]), np.array([0.0, h]))
    swing = 0.25 * h * (halves[0] - halves[1])
    fine = np.linspace(0.0, 1.0, 2001)
    exact = h * np.trapezoid(under_thrust(fine, h, halves, d, mass), fine)
    assert (found.swung[0] * swing + found.bent[0] * (d[0] - d[1])) / mass == pytest.approx(exact, rel=1e-4)


def test_what_a_wandering_disturbance_leaves_open_is_the_variance_of_brownian_motions_integral():
    """Given velocity and force at both ends, the path between them is a cubic and what is left open about it."""
    rng = np.random.default_rng(1)
    h, n = 0.1, 400
    force = np.cumsum(rng.normal(size=(20_000, n)), axis=1) * np.sqrt(h / n)
    force = np.column_stack([np.zeros(len(force)), force])
    s = np.linspace(0.0, 1.0, n + 1)
    bridge = force - s * force[:, -1:]
    nu = (
        np.column_stack([np.zeros(len(force)), np.cumsum(0.5 * (bridge[:, 1:] + bridge[:, :-1]), axis=1)])
        * h
        / n
    )
    off = nu - (3 * s**2 - 2 * s**3) * nu[:, -1:]
    for at in (0.25, 0.5):
        found = readings(read_by(VELOCITY, [at * h], [0.0]), np.array([0.0, h]))
        assert found.open[0] == pytest.approx(np.var(off[:, round(at * n)]), rel=0.05)
    whole = readings(read_by(INCREMENT, [h], [0.0], scale=[h]), np.array([0.0, h]))
    assert whole.open[0] == pytest.approx(np.var(h * np.trapezoid(off, s, axis=1)), rel=0.05)
    mean = readings(
        read_by(VELOCITY, np.array([0.1, 0.3, 0.5, 0.7, 0.9]) * h, np.zeros(5)), np.array([0.0, h])
    )
    assert mean.open[0] == pytest.approx(np.var(np.trapezoid(off, s, axis=1)), rel=0.05)


def test_without_increments_the_instants_are_even_and_reach_the_last_reading():
    found = instants((read_by(VELOCITY, np.array([2.0, 2.33, 3.04]), np.zeros(3)),), 0.1)
    np.testing.assert_allclose(found, 2.0 + 0.1 * np.arange(12))


def test_instants_lie_where_increments_end():
    ends = 1.0 + 0.05 * np.arange(21)
    found = instants((read_by(INCREMENT, ends, np.zeros(21), np.full(21, 0.05)),), 0.1)
    np.testing.assert_allclose(found, ends[::2])


def test_both_ends_of_a_gap_are_instants_and_the_gap_is_filled():
    ends = np.concatenate([1.0 + 0.05 * np.arange(8), 2.0 + 0.05 * np.arange(8)])
    value = np.zeros(16)
    value[[0, 8]] = np.nan
    axis = read_by(INCREMENT, ends, value, np.full(16, 0.05))
    found = instants((axis,), 0.1)
    assert {1.35, 2.0} <= set(np.round(found, 6).tolist())
    assert np.diff(found).max() < 0.125
    known = np.isfinite(readings_in(axis, 0, found, 3, 0, 2).value)
    middle = 0.5 * (found[1:] + found[:-1])
    assert known[(middle < 1.35) & (middle > 1.0)].all()
    assert not known[(middle > 1.35) & (middle < 2.0)].any()
    assert known[middle > 2.0].all()


def test_every_increment_of_a_dive_with_gaps_is_used_once():
    rng = np.random.default_rng(3)
    ends = 0.05 * np.arange(1, 400)
    keep = rng.random(len(ends)) > 0.05
    keep[0] = False
    fresh = keep & ~np.concatenate([[True], keep[:-1]])
    time_s = np.concatenate([ends[keep], ends[fresh] - 0.05])
    value = np.concatenate([np.full(keep.sum(), 0.01), np.full(fresh.sum(), np.nan)])
    order = np.argsort(time_s, kind="stable")
    axis = read_by(INCREMENT, time_s[order], value[order], np.full(len(order), 0.05))
    found = readings_in(axis, 0, instants((axis,), 0.1), 3, 0, 2)
    assert np.nansum(found.value) == pytest.approx(0.01 * keep.sum())
