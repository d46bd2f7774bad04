"""The network's physics: Fossen's terms, exact readings over intervals, and nothing that pulls on an exact motion."""

import network_tasks
import numpy as np
import pytest
import torch
from network_tasks import read_by
from soak import rows_rest_in_soak

from bridge.vehicle.config import Configuration, Thruster
from bridge.vehicle.dynamics import coriolis
from identify.estimators.innovations import INCREMENT, POSITION, VELOCITY
from identify.estimators.pinn.equations import by_raw
from identify.estimators.pinn.layout import (
    Coefficients,
    Interval,
    Layout,
    Readings,
    balance,
    by_coefficients,
    coriolis_forms,
    instants,
    readings_in,
)
from identify.estimators.pinn.network import between, data_of, pull, wild, without
from identify.estimators.pinn.parameters import Noise, raw_of

MASS = torch.tensor([100.0, 120.0, 135.0, 9.0, 14.0, 16.0], dtype=torch.float64)


def wave(*shape, phase=0.0):
    return (torch.arange(int(np.prod(shape)), dtype=torch.float64) * 1.7 + phase).sin().reshape(shape)


def case(dofs, placed):
    """Three intervals of a made-up dive: what is known, coefficients, and states at its four nodes."""
    n = len(dofs)
    others = 0.3 * wave(3, 6, phase=1.0)
    others[:, list(dofs)] = 0.0
    stiffness = torch.zeros(n, dtype=torch.float64)
    stiffness[list(placed)] = 25.0
    known = Interval(
        dofs,
        placed,
        torch.tensor([0.1, 0.08, 0.13], dtype=torch.float64),
        20.0 * wave(3, n, phase=2.0),
        0.3 * wave(3, n, phase=3.0),
        others,
        stiffness,
        torch.as_tensor(coriolis_forms()),
    )
    given = Coefficients(MASS, 50.0 + 10.0 * wave(n), wave(n, phase=4.0))
    return known, given, 0.4 * wave(4, 2 * n + len(placed), phase=5.0)


CASES = [((0,), ()), ((0, 1, 5), ()), ((2, 3, 4), (1, 2)), ((0, 1, 2, 3, 4, 5), (2, 3, 4))]


def test_the_forms_give_the_coriolis_forces_of_the_one_definition():
    draw = np.random.default_rng(0)
    for _ in range(5):
        mass, nu = draw.uniform(1.0, 100.0, 6), draw.normal(size=6)
        said = np.einsum("ijkl,j,k,l->i", coriolis_forms(), mass, nu, nu)
        np.testing.assert_allclose(said, np.array(coriolis(mass.tolist(), nu.tolist())), atol=1e-9)


@pytest.mark.parametrize(("dofs", "placed"), CASES)
def test_every_slope_of_the_balance_is_that_of_automatic_differentiation(dofs, placed):
    known, given, state = case(dofs, placed)
    n = len(dofs)

    def residual(mass, damping, trim, at):
        return balance(known, Coefficients(mass, damping, trim), at).residual

    by_mass, by_damping, by_trim, by_state = torch.func.jacrev(residual, argnums=(0, 1, 2, 3))(
        given.mass, given.damping, given.trim, state
    )
    found = balance(known, given, state)
    leans = by_coefficients(known, given, state, found)
    torch.testing.assert_close(leans, torch.cat([by_mass, by_damping, by_trim], dim=2))
    for k in range(3):
        torch.testing.assert_close(found.before[k], by_state[k, :, k])
        torch.testing.assert_close(found.after[k], by_state[k, :, k + 1])
    assert found.residual.shape == (3, n)


def steady(nu, push, disturbance=0.0):
    """Residuals (1, 6) of a steady motion `nu` (6,) under `push` (6,)."""
    known = Interval(
        tuple(range(6)),
        (),
        torch.tensor([0.1], dtype=torch.float64),
        push[None],
        torch.zeros(1, 6, dtype=torch.float64),
        torch.zeros(1, 6, dtype=torch.float64),
        torch.zeros(6, dtype=torch.float64),
        torch.as_tensor(coriolis_forms()),
    )
    given = Coefficients(MASS, 0.5 * MASS, torch.zeros(6, dtype=torch.float64))
    state = torch.cat([nu, torch.full((6,), disturbance, dtype=torch.float64)])[None].expand(2, 12)
    return balance(known, given, state).residual


def test_a_steady_turn_under_the_force_that_holds_it_leaves_nothing_over():
    nu = torch.tensor([0.5, -0.2, 0.1, 0.05, -0.1, 0.3], dtype=torch.float64)
    holds = torch.stack(coriolis(tuple(MASS), tuple(nu))) + 0.5 * MASS * nu
    torch.testing.assert_close(steady(nu, holds), torch.zeros(1, 6, dtype=torch.float64))


def test_an_exact_run_up_under_constant_thrust_leaves_next_to_nothing_over():
    """M u' + D u = F from rest: the mean velocity is Euler and Maclaurin's, off by h^4 / 720 of the fourth slope."""
    mass, damping, force = 100.0, 50.0, 30.0
    for h in (0.2, 0.1):
        u = force / damping * (1 - np.exp(-damping / mass * np.array([0.0, h])))
        known, _, _ = case((0,), ())
        one = Interval(
            (0,),
            (),
            torch.tensor([h], dtype=torch.float64),
            torch.tensor([[force]], dtype=torch.float64),
            torch.zeros(1, 1, dtype=torch.float64),
            torch.zeros(1, 6, dtype=torch.float64),
            torch.zeros(1, dtype=torch.float64),
            known.forms,
        )
        given = Coefficients(
            torch.full((6,), mass, dtype=torch.float64),
            torch.tensor([damping], dtype=torch.float64),
            torch.zeros(1, dtype=torch.float64),
        )
        state = torch.zeros(2, 2, dtype=torch.float64)
        state[:, 0] = torch.as_tensor(u)
        fourth_slope = -force / mass * (damping / mass) ** 3 * np.exp(-0.5 * damping * h / mass)
        left = float(balance(one, given, state).residual[0, 0])
        assert left == pytest.approx(-damping * h**5 / 720 * fourth_slope, rel=2e-2)


SHAPE = Configuration(
    dry_mass_kg=40.0,
    inertia_kgm2=(3.0, 9.0, 10.0),
    thrusters=(Thruster((0.0, 0.0, 1.0), (0.0, 0.0, 0.0)),),
)
HEAVE, STATE_MASS, H, STEPS = 2, 50.0, 0.1, 30


def motion():
    """Heave without drag under thrusts whose halves differ and a disturbance of straight lines, integrated exactly.

    State (N + 1, 3), forces (N, 2) of both halves, and times, velocity and depth in fine steps.
    """
    rng = np.random.default_rng(0)
    halves, d = rng.normal(0.0, 20.0, (STEPS, 2)), rng.normal(0.0, 3.0, STEPS + 1)
    each = 200
    s = (np.arange(each) + 0.5) / each
    force = np.where(s < 0.5, halves[:, :1], halves[:, 1:]) + d[:-1, None] + np.diff(d)[:, None] * s
    nu = 0.1 + np.concatenate([[0.0], np.cumsum(force.ravel())]) * H / each / STATE_MASS
    x = 5.0 + np.concatenate([[0.0], np.cumsum(0.5 * (nu[1:] + nu[:-1]))]) * H / each
    state = np.column_stack([nu[::each], d, x[::each]])
    return state, halves, np.arange(len(nu)) * H / each, nu, x


def laid_out(readings: list[Readings], halves) -> Layout:
    def stacked(part):
        return np.stack([getattr(one, part) for one in readings], axis=1)

    count = len(readings)
    return Layout(
        (HEAVE,),
        (0,),
        H * np.arange(STEPS + 1),
        np.full(STEPS, H),
        halves.mean(axis=1)[:, None],
        0.25 * H * (halves[:, :1] - halves[:, 1:]),
        np.zeros((STEPS, 6)),
        np.zeros(1),
        *(stacked(part) for part in ("value", "before", "after", "swung", "bent", "open", "scale")),
        np.zeros(count, dtype=np.int64),
        ("dvl", "depth", "turn")[:count],
        np.array([VELOCITY, POSITION, INCREMENT])[:count],
        np.full(count, 1e-3),
        np.ones(count),
        np.ones(count),
    )


def exact():
    """Data of the exact motion, read at odd moments and at the nodes, with its state."""
    state, halves, time_s, nu, x = motion()
    nodes = H * np.arange(STEPS + 1)
    odd = nodes[:-1] + 0.37 * H
    found = [
        readings_in(network_tasks.read_by(VELOCITY, odd, np.interp(odd, time_s, nu)), 0, nodes, 3, 0, 2),
        readings_in(network_tasks.read_by(POSITION, nodes, np.interp(nodes, time_s, x)), 0, nodes, 3, 0, 2),
        readings_in(
            network_tasks.read_by(INCREMENT, nodes[1:], np.diff(state[:, 2]), np.full(STEPS, H)),
            0,
            nodes,
            3,
            0,
            2,
        ),
    ]
    data = data_of(laid_out(found, halves), network_tasks.CPU)
    map_ = raw_of(SHAPE, (HEAVE,), network_tasks.CPU)
    values = map_.middle.clone()
    values[HEAVE], values[6], values[7] = STATE_MASS, 1e-4, 0.0
    noise = Noise(*(torch.tensor(v, dtype=torch.float64) for v in ([1e-3, 1e-3, 1e-3], [3.0], [2.0])))
    return data, map_, map_.raw(values), noise, torch.as_tensor(state)


def test_an_exact_motion_leaves_physics_positions_and_readings_with_nothing_over():
    data, map_, raw, noise, state = exact()
    pulled = pull(data, map_, raw, state, noise)
    left = pulled.residual * pulled.std
    assert float(left[:, 0].abs().max()) < 1e-5 * STATE_MASS
    assert float(left[:, 2].abs().max()) < 1e-6
    assert float(left[:, 3:].abs().max()) < 1e-5


def test_the_disturbances_own_row_is_a_first_order_gauss_markov_step():
    data, map_, raw, noise, state = exact()
    pulled = pull(data, map_, raw, state, noise)
    d, kept = state[:, 1], np.exp(-H / 2.0)
    expected = (d[1:] - kept * d[:-1]) / (3.0 * np.sqrt(1 - kept**2))
    torch.testing.assert_close(pulled.residual[:, 1], expected)


def test_the_noise_of_an_increment_grows_with_its_length():
    data, map_, raw, noise, state = exact()
    pulled = pull(data, map_, raw, state, noise)
    assert float(pulled.std[0, 5]) == pytest.approx(1e-3 * H, rel=1e-2)


@pytest.mark.parametrize(
    ("seed", "kind"), rows_rest_in_soak([(100_002, "rocking"), (100_033, "depth steps")])
)
def test_every_slope_of_the_pull_is_that_of_automatic_differentiation(seed, kind):
    task = network_tasks.drawn(seed, kind, 22.0)
    data, map_, point = between(task.trainer.data, slice(80, 83)), task.trainer.map_, task.start
    state = point.equations.state[80:84]
    found = pull(data, map_, point.raw, state, point.noise)

    def unscaled(raw, at):
        one = pull(data, map_, raw, at, point.noise)
        return one.residual * one.std

    in_raw, by_state = torch.func.jacrev(unscaled, argnums=(0, 1))(point.raw, state)
    std = found.std[:, :, None]
    leans = by_raw(data, map_, point.raw, state, found)
    torch.testing.assert_close(leans * std, in_raw, rtol=1e-6, atol=1e-9)
    for k in range(3):
        torch.testing.assert_close(found.before[k] * std[k], by_state[k, :, k], rtol=1e-6, atol=1e-9)
        torch.testing.assert_close(found.after[k] * std[k], by_state[k, :, k + 1], rtol=1e-6, atol=1e-9)


def test_a_wild_reading_is_found_and_pulls_no_more_once_it_is_left_out():
    data, map_, raw, noise, state = exact()
    data.value[7, 0] += 1.0
    found = wild(data, map_, raw, noise, state)
    assert found.nonzero().tolist() == [[7, 0]]
    left = pull(without(data, found), map_, raw, state, noise)
    assert float(left.residual[7, 3].abs()) == 0.0
    assert float(left.before[7, 3].abs().max()) == 0.0


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


def test_readings_of_one_interval_become_their_mean_with_the_noise_of_a_mean():
    found = readings(read_by(VELOCITY, TIMES, np.interp(TIMES, NODES, NU), scale=2.0 * np.ones(7)))
    assert found.value[0] == pytest.approx(np.mean(np.interp(TIMES[:3], NODES, NU)))
    assert found.scale[0] == pytest.approx(2.0 / np.sqrt(3))
    assert found.scale[2] == pytest.approx(2.0)
    early = readings(read_by(VELOCITY, TIMES, np.where(TIMES < 0.2, np.nan, 1.0)))
    assert np.isfinite(early.value).tolist() == [False, False, True, True]


def test_increments_of_one_interval_add_up_and_one_that_they_do_not_fill_is_left_out():
    ends = np.array([0.05, 0.1, 0.15, 0.2])
    value = np.array([0.01, 0.02, 0.03, -0.01])
    found = readings(read_by(INCREMENT, ends, value, scale=np.full(4, 0.05)), NODES[:3])
    np.testing.assert_allclose(found.value, [0.03, 0.02])
    np.testing.assert_allclose(found.scale, np.sqrt(2 * 0.05**2))
    np.testing.assert_allclose(found.before[:, 0], 0.05)
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
        found = readings(read_by(VELOCITY, [at * h], [0.0]), np.array([0.0, h]))
        assert found.open[0] == pytest.approx(np.var(off[:, round(at * n)]), rel=0.08)
    whole = readings(read_by(INCREMENT, [h], [0.0], scale=[h]), np.array([0.0, h]))
    assert whole.open[0] == pytest.approx(np.var(h * np.trapezoid(off, s, axis=1)), rel=0.08)
    mean = readings(
        read_by(VELOCITY, np.array([0.1, 0.3, 0.5, 0.7, 0.9]) * h, np.zeros(5)), np.array([0.0, h])
    )
    assert mean.open[0] == pytest.approx(np.var(np.trapezoid(off, s, axis=1)), rel=0.08)


def test_without_increments_the_instants_are_even_and_reach_the_last_reading():
    found = instants((read_by(VELOCITY, np.array([2.0, 2.33, 3.04]), np.zeros(3)),), 0.1)
    np.testing.assert_allclose(found, 2.0 + 0.1 * np.arange(12))


def test_instants_lie_where_increments_end():
    ends = 1.0 + 0.05 * np.arange(21)
    found = instants((read_by(INCREMENT, ends, np.zeros(21), np.full(21, 0.05)),), 0.1)
    np.testing.assert_allclose(found, ends[::2])


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
