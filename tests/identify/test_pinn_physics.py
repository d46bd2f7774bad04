"""The network's physics: Fossen's terms, slopes, and exact readings over intervals."""

import network_tasks
import numpy as np
import pytest
import torch
from network_tasks import read_by
from soak import rows_rest_in_soak

from bridge.vehicle.dynamics import coriolis
from identify.estimators.filter.state import INCREMENT, VELOCITY
from identify.estimators.pinn.equations import by_raw
from identify.estimators.pinn.layout import between, coriolis_forms, instants, readings_in
from identify.estimators.pinn.network import pull


def test_the_forms_give_the_coriolis_forces_of_the_one_definition():
    draw = np.random.default_rng(0)
    for _ in range(5):
        mass, nu = draw.uniform(1.0, 100.0, 6), draw.normal(size=6)
        forces = np.einsum("ijkl,j,k,l->i", coriolis_forms(), mass, nu, nu)
        np.testing.assert_allclose(forces, np.array(coriolis(mass.tolist(), nu.tolist())), atol=1e-9)


@pytest.mark.parametrize(
    ("seed", "kind"), rows_rest_in_soak([(100_002, "rocking"), (100_033, "depth steps")])
)
def test_every_slope_of_the_pull_is_that_of_automatic_differentiation(seed, kind):
    task = network_tasks.drawn(seed, kind, 22.0)
    data, map_, point = between(task.trainer.data, slice(80, 83)), task.trainer.map_, task.start
    state = point.equations.state[80:84]
    pulled = pull(data, map_, point.raw, state, point.noise)

    def unscaled(raw, at):
        moved = pull(data, map_, raw, at, point.noise)
        return moved.residual * moved.std

    in_raw, by_state = torch.func.jacrev(unscaled, argnums=(0, 1))(point.raw, state)
    std = pulled.std[:, :, None]
    leans = by_raw(data, map_, point.raw, state, pulled)
    torch.testing.assert_close(leans * std, in_raw, rtol=1e-6, atol=1e-9)
    for k in range(3):
        torch.testing.assert_close(pulled.before[k] * std[k], by_state[k, :, k], rtol=1e-6, atol=1e-9)
        torch.testing.assert_close(pulled.after[k] * std[k], by_state[k, :, k + 1], rtol=1e-6, atol=1e-9)


NODES = np.array([0.0, 0.1, 0.2, 0.35, 0.45])
NU = np.array([0.2, 0.5, -0.1, 0.0, 0.3])
"""Velocity at the nodes; straight lines between them."""


def readings(axis, nodes=NODES):
    return readings_in(axis, 0, nodes, 3, 0, 2)


TIMES = np.array([0.0, 0.03, 0.07, 0.1, 0.25, 0.41, 0.45])


def test_readings_of_one_interval_become_their_mean_with_the_noise_of_a_mean():
    binned = readings(read_by(VELOCITY, TIMES, np.interp(TIMES, NODES, NU), scale=2.0 * np.ones(7)))
    assert binned.value[0] == pytest.approx(np.mean(np.interp(TIMES[:3], NODES, NU)))
    assert binned.scale[0] == pytest.approx(2.0 / np.sqrt(3))
    assert binned.scale[2] == pytest.approx(2.0)
    early = readings(read_by(VELOCITY, TIMES, np.where(TIMES < 0.2, np.nan, 1.0)))
    assert np.isfinite(early.value).tolist() == [False, False, True, True]


def test_increments_of_one_interval_add_up_and_one_that_they_do_not_fill_is_left_out():
    ends = np.array([0.05, 0.1, 0.15, 0.2])
    value = np.array([0.01, 0.02, 0.03, -0.01])
    binned = readings(read_by(INCREMENT, ends, value, scale=np.full(4, 0.05)), NODES[:3])
    np.testing.assert_allclose(binned.value, [0.03, 0.02])
    np.testing.assert_allclose(binned.scale, np.sqrt(2 * 0.05**2))
    np.testing.assert_allclose(binned.before[:, 0], 0.05)
    part = readings(read_by(INCREMENT, ends[:3], value[:3], scale=np.full(3, 0.05)), NODES[:3])
    assert np.isfinite(part.value).tolist() == [True, False]


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
    binned = readings(read_by(VELOCITY, [s * h], [0.0]), np.array([0.0, h]))
    swing = 0.25 * h * (halves[0] - halves[1])
    off = (binned.swung[0] * swing + binned.bent[0] * (d[0] - d[1])) / mass
    assert off == pytest.approx(under_thrust(s, h, halves, d, mass), abs=1e-5)


@pytest.mark.parametrize(("halves", "d"), [((30.0, -10.0), (0.0, 0.0)), ((0.0, 0.0), (4.0, -1.0))])
def test_an_increment_holds_the_integral_of_swing_and_bend(halves, d):
    h, mass = 0.1, 50.0
    binned = readings(read_by(INCREMENT, [h], [0.0], scale=[h]), np.array([0.0, h]))
    swing = 0.25 * h * (halves[0] - halves[1])
    fine = np.linspace(0.0, 1.0, 2001)
    exact = h * np.trapezoid(under_thrust(fine, h, halves, d, mass), fine)
    assert (binned.swung[0] * swing + binned.bent[0] * (d[0] - d[1])) / mass == pytest.approx(exact, rel=1e-4)


def test_what_a_wandering_disturbance_leaves_open_is_the_variance_of_brownian_motions_integral():
    """Given velocity and force at both ends, the path between them is a cubic and what is left open about it."""
    rng = np.random.default_rng(1)
    h, n = 0.1, 400
    force = np.cumsum(rng.normal(size=(5_000, n)), axis=1) * np.sqrt(h / n)
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
        binned = readings(read_by(VELOCITY, [at * h], [0.0]), np.array([0.0, h]))
        assert binned.open[0] == pytest.approx(np.var(off[:, round(at * n)]), rel=0.08)
    whole = readings(read_by(INCREMENT, [h], [0.0], scale=[h]), np.array([0.0, h]))
    assert whole.open[0] == pytest.approx(np.var(h * np.trapezoid(off, s, axis=1)), rel=0.08)
    mean = readings(
        read_by(VELOCITY, np.array([0.1, 0.3, 0.5, 0.7, 0.9]) * h, np.zeros(5)), np.array([0.0, h])
    )
    assert mean.open[0] == pytest.approx(np.var(np.trapezoid(off, s, axis=1)), rel=0.08)


def test_without_increments_the_instants_are_even_and_reach_the_last_reading():
    times = instants((read_by(VELOCITY, np.array([2.0, 2.33, 3.04]), np.zeros(3)),), 0.1)
    np.testing.assert_allclose(times, 2.0 + 0.1 * np.arange(12))


def test_instants_lie_where_increments_end():
    ends = 1.0 + 0.05 * np.arange(21)
    times = instants((read_by(INCREMENT, ends, np.zeros(21), np.full(21, 0.05)),), 0.1)
    np.testing.assert_allclose(times, ends[::2])


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
    binned = readings_in(axis, 0, instants((axis,), 0.1), 3, 0, 2)
    assert np.nansum(binned.value) == pytest.approx(0.01 * keep.sum())
