"""Training ends with a reason: settled, flat, or at its bound; a step that leads up is shortened."""

from dataclasses import dataclass, field
from types import SimpleNamespace

import pytest
import torch

from identify.estimators.pinn.raw import Noise, Prior
from identify.estimators.pinn.training import MOST_PASSES, Point, Trainer

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
    bowl = Bowl(SimpleNamespace(axes=1), None, prior, lambda _: full, passes.append, shape)
    state = torch.zeros(1, 1, dtype=torch.float64)
    point = bowl.at(torch.tensor([start], dtype=torch.float64), LEVELS, state)
    return bowl, bowl.train(point), passes


def test_a_quadratic_loss_of_known_curvature_is_settled_in_one_pass():
    _, found, passes = train(lambda x: 50 * (x - 0.4) ** 2, 100.0)
    assert found.settled
    assert float(found.raw) == pytest.approx(0.4)
    assert len(passes) == found.passes == 2
    assert "10 % of its standard error" in found.reason


def test_a_curvature_that_is_taken_for_ten_times_too_large_makes_training_creep_for_one_step_alone():
    """By the curvature given alone, every step would leave nine tenths of the way: here the second ends it."""
    _, found, _ = train(lambda x: 50 * (x - 0.05) ** 2, 1000.0)
    assert found.settled
    assert found.passes == 3
    assert float(found.raw) == pytest.approx(0.05)


def test_a_step_that_leads_up_is_shortened():
    """The curvature given is a fifth of the true one: the whole step goes four times too far."""
    bowl, found, _ = train(lambda x: 50 * (x - 0.1) ** 2, 20.0)
    assert max(bowl.asked) == pytest.approx(0.5)
    assert found.settled
    assert float(found.raw) == pytest.approx(0.1, abs=0.04)


def test_a_pass_moves_no_raw_parameter_by_more_than_one():
    bowl, found, _ = train(lambda x: 50 * (x - 7.0) ** 2, 100.0)
    steps = [b - a for a, b in zip(bowl.asked, bowl.asked[1:], strict=False)]
    assert max(steps) == pytest.approx(1.0)
    assert float(found.raw) == pytest.approx(7.0, abs=0.01)


def test_a_loss_that_falls_no_more_ends_training_with_that_reason():
    _, found, _ = train(lambda x: 1e-3 * x, 1e-5)
    assert found.settled
    assert "fell by less" in found.reason


def test_a_loss_without_an_end_is_left_at_the_bound_of_passes_and_not_called_settled():
    _, found, passes = train(lambda x: -x, 1.0)
    assert not found.settled
    assert len(passes) == found.passes == MOST_PASSES
    assert found.reason


def test_the_curvature_comes_with_the_priors_and_without():
    _, found, _ = train(lambda x: 50 * (x - 0.4) ** 2, 100.0)
    added = found.curvature - found.told
    torch.testing.assert_close(
        added.diagonal(), torch.tensor([0.0, 1.0, 1.0 / 9.0, 1.0], dtype=torch.float64)
    )


def test_a_loss_that_only_rises_is_never_called_settled():
    @dataclass(frozen=True)
    class Misled(Bowl):
        def at(self, raw, noise, state):
            point = super().at(raw, noise, state)
            return Point(raw, noise, point.equations, -point.slope)

    full = torch.diag(torch.tensor([1.0, 1.0, 1.0, 1.0], dtype=torch.float64))
    bowl = Misled(
        SimpleNamespace(axes=1), None, Prior(LEVELS, ONE), lambda _: full, lambda _: None, lambda x: 2 * x**2
    )
    start = bowl.at(torch.tensor([1.0], dtype=torch.float64), LEVELS, torch.zeros(1, 1, dtype=torch.float64))
    found = bowl.train(start)
    assert bowl.loss(found.point) > bowl.loss(start)
    assert not found.settled
