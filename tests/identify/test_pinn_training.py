"""The network's equations and training: blocks, slopes, levels, and an end with a reason."""

from dataclasses import dataclass, field
from types import SimpleNamespace

import network_tasks
import numpy as np
import pytest
import torch
from soak import rows_rest_in_soak

from bridge.vehicle.config import Configuration, Thruster
from identify.estimators.pinn.network import factorise, selected_inverse, solve
from identify.estimators.pinn.parameters import Moments, Noise, Prior, of_logarithm, raw_of, slope
from identify.estimators.pinn.training import Point, Trainer

ONE = torch.ones(1, dtype=torch.float64)
LEVELS = Noise(ONE, ONE, ONE)


@dataclass(frozen=True)
class Bowl(Trainer):
    """A loss of known shape in one raw parameter in place of a network's, `asked` wherever a step was tried."""

    shape: object = None
    asked: list = field(default_factory=list)

    def at(self, raw, noise, state):
        self.asked.append(float(raw))
        value = raw.clone().requires_grad_()
        half_loss = self.shape(value).sum()
        (slope,) = torch.autograd.grad(half_loss, value)
        equations = SimpleNamespace(
            loss=2 * float(half_loss.detach()),
            state=state,
            tilt=torch.zeros(1, dtype=torch.float64),
        )
        return Point(raw, noise, equations, torch.cat([slope, torch.zeros(3, dtype=torch.float64)]))


def train(shape, curvature, start=0.0):
    """The bowl, what training it comes to, and the passes that were told."""
    passes = []
    prior = Prior(LEVELS, ONE)
    full = torch.eye(4, dtype=torch.float64)
    full[0, 0] = curvature
    bowl = Bowl(
        SimpleNamespace(axes=1), None, prior, lambda _: full, lambda point, _: passes.append(point), shape
    )
    state = torch.zeros(1, 1, dtype=torch.float64)
    point = bowl.at(torch.tensor([start], dtype=torch.float64), LEVELS, state)
    return bowl, bowl.train(point), passes


def test_a_quadratic_loss_of_known_curvature_is_settled_in_one_pass():
    _, trained, passes = train(lambda x: 50 * (x - 0.4) ** 2, 100.0)
    assert trained.settled
    assert float(trained.raw) == pytest.approx(0.4)
    assert len(passes) == trained.passes == 2
    assert "10 % of its standard error" in trained.reason
    of_priors = torch.tensor([0.0, 1.0, 1.0 / 9.0, 1.0], dtype=torch.float64)
    torch.testing.assert_close((trained.curvature - trained.curvature_by_data).diagonal(), of_priors)


def test_a_curvature_that_is_taken_for_ten_times_too_large_makes_training_creep_for_one_step_alone():
    """By the curvature given alone, every step would leave nine tenths of the way: here the second ends it."""
    _, trained, _ = train(lambda x: 50 * (x - 0.05) ** 2, 1000.0)
    assert trained.settled
    assert trained.passes == 3
    assert float(trained.raw) == pytest.approx(0.05)


def test_a_step_that_leads_up_is_shortened():
    """The curvature given is a fifth of the true one: the whole step goes four times too far."""
    bowl, trained, _ = train(lambda x: 50 * (x - 0.1) ** 2, 20.0)
    assert max(bowl.asked) == pytest.approx(0.5)
    assert trained.settled
    assert float(trained.raw) == pytest.approx(0.1, abs=0.04)


def test_a_pass_moves_no_raw_parameter_by_more_than_one():
    bowl, trained, _ = train(lambda x: 50 * (x - 7.0) ** 2, 100.0)
    steps = [b - a for a, b in zip(bowl.asked, bowl.asked[1:], strict=False)]
    assert max(steps) == pytest.approx(1.0)
    assert float(trained.raw) == pytest.approx(7.0, abs=0.01)


def test_a_loss_that_falls_no_more_ends_training_with_that_reason():
    _, trained, _ = train(lambda x: 1e-3 * x, 1e-5)
    assert trained.settled
    assert "fell by less" in trained.reason


def test_a_loss_without_an_end_is_left_at_the_bound_of_passes_and_not_called_settled():
    _, trained, passes = train(lambda x: -x, 1.0)
    assert not trained.settled
    assert len(passes) == trained.passes == 40
    assert trained.reason


def test_a_loss_that_only_rises_is_never_called_settled():
    @dataclass(frozen=True)
    class Misled(Bowl):
        def at(self, raw, noise, state):
            point = super().at(raw, noise, state)
            return Point(raw, noise, point.equations, -point.slope)

    full = torch.diag(torch.tensor([1.0, 1.0, 1.0, 1.0], dtype=torch.float64))
    bowl = Misled(
        SimpleNamespace(axes=1), None, Prior(LEVELS, ONE), lambda _: full, lambda *_: None, lambda x: 2 * x**2
    )
    start = bowl.at(torch.tensor([1.0], dtype=torch.float64), LEVELS, torch.zeros(1, 1, dtype=torch.float64))
    trained = bowl.train(start)
    assert bowl.loss(trained.point) > bowl.loss(start)
    assert not trained.settled


NODES = [1, 2, 3, 8, 9, 17]


def tridiagonal(nodes, width=3):
    """A positive definite matrix: its blocks on and above the diagonal, and all of it."""
    draw = torch.Generator().manual_seed(nodes)
    first = torch.randn(nodes, width, width, generator=draw, dtype=torch.float64)
    second = torch.randn(nodes, width, width, generator=draw, dtype=torch.float64)
    rows = torch.zeros(nodes * width, nodes * width, dtype=torch.float64)
    for k in range(nodes):
        here = slice(k * width, (k + 1) * width)
        rows[here, here] = first[k]
        if k + 1 < nodes:
            rows[here, (k + 1) * width : (k + 2) * width] = second[k]
    dense = rows.mT @ rows + torch.eye(nodes * width, dtype=torch.float64)
    blocks = dense.reshape(nodes, width, nodes, width).transpose(1, 2)
    each = torch.arange(nodes)
    return blocks[each, each], blocks[each[:-1], each[1:]], dense


@pytest.mark.parametrize("at_a_time", [None, 3])
@pytest.mark.parametrize("nodes", NODES)
def test_solution_log_determinant_and_selected_inverse_are_those_of_the_dense_matrix(
    nodes, at_a_time, monkeypatch
):
    """Also by stretches of a few nodes."""
    if at_a_time is not None:
        monkeypatch.setattr("identify.estimators.pinn.network.AT_A_TIME", at_a_time)
    diagonal, above, dense = tridiagonal(nodes)
    given = diagonal.clone()
    right = torch.arange(nodes * 3 * 2, dtype=torch.float64).sin().reshape(nodes, 3, 2)
    factor = factorise(diagonal, above)
    solution = solve(factor, right)
    torch.testing.assert_close(solution.flatten(0, 1), torch.linalg.solve(dense, right.flatten(0, 1)))
    torch.testing.assert_close(factor.log_det, torch.linalg.slogdet(dense).logabsdet)
    inverse = torch.linalg.inv(dense).reshape(nodes, 3, nodes, 3).transpose(1, 2)
    each = torch.arange(nodes)
    on, off_diagonal = selected_inverse(factor)
    torch.testing.assert_close(on, inverse[each, each])
    torch.testing.assert_close(off_diagonal, inverse[each[:-1], each[1:]])
    assert torch.equal(diagonal, given)


def test_a_matrix_that_is_not_positive_definite_is_refused():
    diagonal, above, _ = tridiagonal(5)
    with pytest.raises(torch.linalg.LinAlgError):
        factorise(-diagonal, above)


MOVE = 1e-3


@pytest.mark.slow
@pytest.mark.parametrize(
    ("seed", "kind", "fog_gap_s", "each"),
    rows_rest_in_soak(
        [
            (100_002, "rocking", (8.0, 10.0), 12),
            (100_002, "rocking", (8.0, 10.0), 1),
            (100_009, "spin", None, 1),
        ]
    ),
    ids=["every twelfth, a FOG with a gap", "all, a FOG with a gap", "all, gyros alone"],
)
def test_the_slope_in_coefficients_and_noise_levels_is_that_of_central_differences(
    seed, kind, fog_gap_s, each
):
    """But for what the curvature of the weights changes with the weights: far below one standard error."""
    task = network_tasks.drawn(seed, kind, 16.0, fog_gap_s)
    trainer, start = task.trainer, task.start
    point = network_tasks.settled(trainer, start.raw, start.noise, start.equations.state)
    middle = point.where()
    one_error = trainer.curvature_at(point).diagonal().clamp_min(0).sqrt()
    assert len(task.layout.dofs) == 6
    for index in range(0, len(middle), each):
        row = torch.zeros_like(middle)
        row[index] = MOVE
        above, below = (network_tasks.at_row(trainer, point, middle + sign * row) for sign in (1, -1))
        central = (trainer.loss(above) - trainer.loss(below)) / (4 * MOVE)
        allowed = 1e-3 * abs(central) + 5e-3 * float(one_error[index]) + 1e-4
        assert float(point.slope[index]) == pytest.approx(central, abs=allowed), index


SHAPE = Configuration(
    dry_mass_kg=40.0,
    inertia_kgm2=(3.0, 9.0, 10.0),
    thrusters=(Thruster((1.0, 0.0, 0.0), (0.0, 0.0, 0.0)),),
)
MAP = raw_of(SHAPE, (0, 5), torch.device("cpu"))
RAW = torch.tensor([-2.0, 0.3, 1.0, 4.0, 0.1, -0.5, 2.0, 0.7, -3.0, 3.0], dtype=torch.float64)


def row(*values):
    return torch.tensor(values, dtype=torch.float64)


def test_raw_parameters_are_positive_masses_and_dampings_and_free_trims_in_this_order_and_back_again():
    low = MAP.values(torch.full((10,), -30.0, dtype=torch.float64))
    assert (low[:8] > 0).all()
    assert (low[8:] < 0).all()
    torch.testing.assert_close(MAP.raw(MAP.values(RAW)), RAW)
    given = MAP.coefficients(RAW)
    torch.testing.assert_close(torch.cat([given.mass, given.damping, given.trim]), MAP.values(RAW))
    assert (len(given.mass), len(given.damping), len(given.trim)) == (6, 2, 2)
    residual, _ = MAP.prior(MAP.raw(MAP.middle))
    torch.testing.assert_close(residual, torch.zeros_like(residual))


def test_the_slopes_of_values_logarithms_and_priors_are_those_of_automatic_differentiation():
    def jacobian(function):
        return torch.func.jacrev(function)(RAW)

    torch.testing.assert_close(torch.diag(MAP.slope(RAW)), jacobian(MAP.values))

    def logarithm(raw):
        values = MAP.values(raw)
        return torch.cat([values[:8].log(), values[8:]])

    torch.testing.assert_close(torch.diag(MAP.to_logarithm(RAW)), jacobian(logarithm))
    _, tilt = MAP.prior(RAW)
    torch.testing.assert_close(torch.diag(tilt), jacobian(lambda raw: MAP.prior(raw)[0]))


def test_a_mass_that_no_axis_weighs_is_held_closer_than_one_that_is_fitted():
    assert (MAP.spread[[1, 2, 3, 4]] < 0.5).all()
    assert (MAP.spread[[0, 5]] > 1.0).all()


NOISE = Noise(row(0.004, 0.001), row(3.0), row(1.6))


def test_a_noise_level_one_spread_above_its_middle_is_one_standard_deviation_off():
    prior = Prior(NOISE, row(1.0, 0.001))
    above = of_logarithm(NOISE.logarithm() + prior.spread(), 1)
    torch.testing.assert_close(prior.residual(above), torch.ones(4, dtype=torch.float64))


def path(disturbance_n, time_s, steps):
    """Moments of a disturbance that is known exactly at every node, and its nodes."""
    rng = np.random.default_rng(2)
    kept = np.exp(-0.1 / time_s)
    d = [disturbance_n * rng.normal()]
    for _ in range(steps):
        d.append(kept * d[-1] + disturbance_n * np.sqrt(1 - kept**2) * rng.normal())
    d = torch.tensor(d, dtype=torch.float64)[:, None]
    zero = torch.zeros(1, dtype=torch.float64)
    return Moments(row(0.0, 0.0), zero, d[:-1] ** 2, d[:-1] * d[1:], d[1:] ** 2, d[0] ** 2), d[:, 0]


def test_the_slope_in_the_levels_of_a_known_disturbance_is_that_of_its_likelihood():
    moments, d = path(3.0, 1.6, 200)
    step_s = torch.full((200,), 0.1, dtype=torch.float64)

    def half_loss(logarithms):
        level, kept = logarithms[0].exp(), torch.exp(-step_s / logarithms[1].exp())
        off, spread = d[1:] - kept * d[:-1], level**2 * (1 - kept**2)
        first = d[0] ** 2 / level**2 + 2 * logarithms[0]
        return 0.5 * ((off**2 / spread + spread.log()).sum() + first)

    at = row(np.log(2.0), np.log(1.1))
    slopes = slope(moments, step_s, Noise(NOISE.sensor, row(2.0), row(1.1)))
    torch.testing.assert_close(slopes[2:], torch.func.grad(half_loss)(at), rtol=1e-6, atol=1e-6)
