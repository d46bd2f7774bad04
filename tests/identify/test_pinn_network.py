"""What pulls on the network: nothing where its state is an exact motion; slopes as differentiation has them."""

import network_tasks
import numpy as np
import pytest
import torch

from bridge.vehicle.config import Configuration, Thruster
from identify.estimators.innovations import INCREMENT, POSITION, VELOCITY
from identify.estimators.pinn.equations import by_raw
from identify.estimators.pinn.layout import Layout, Readings, readings_in
from identify.estimators.pinn.network import between, data_of, pull, wild, without
from identify.estimators.pinn.raw import Noise, raw_of

SHAPE = Configuration(
    dry_mass_kg=40.0,
    inertia_kgm2=(3.0, 9.0, 10.0),
    thrusters=(Thruster((0.0, 0.0, 1.0), (0.0, 0.0, 0.0)),),
)
HEAVE, MASS, H, STEPS = 2, 50.0, 0.1, 30


def motion():
    """Heave without drag under thrusts whose halves differ and a disturbance of straight lines, integrated exactly.

    State (N + 1, 3), forces (N, 2) of both halves, and times, velocity and depth in fine steps.
    """
    rng = np.random.default_rng(0)
    halves, d = rng.normal(0.0, 20.0, (STEPS, 2)), rng.normal(0.0, 3.0, STEPS + 1)
    each = 200
    s = (np.arange(each) + 0.5) / each
    force = np.where(s < 0.5, halves[:, :1], halves[:, 1:]) + d[:-1, None] + np.diff(d)[:, None] * s
    nu = 0.1 + np.concatenate([[0.0], np.cumsum(force.ravel())]) * H / each / MASS
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
    values[HEAVE], values[6], values[7] = MASS, 1e-4, 0.0
    noise = Noise(*(torch.tensor(v, dtype=torch.float64) for v in ([1e-3, 1e-3, 1e-3], [3.0], [2.0])))
    return data, map_, map_.raw(values), noise, torch.as_tensor(state)


def test_an_exact_motion_leaves_physics_positions_and_readings_with_nothing_over():
    data, map_, raw, noise, state = exact()
    pulled = pull(data, map_, raw, state, noise)
    left = pulled.residual * pulled.std
    assert float(left[:, 0].abs().max()) < 1e-5 * MASS
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


@pytest.mark.parametrize(("seed", "kind"), [(100_002, "rocking"), (100_033, "depth steps")])
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
