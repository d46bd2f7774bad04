"""The slope that the network is trained by is that of its loss, weights solved for and integrated out."""

import network_tasks
import pytest
import torch
from soak import rows_rest_in_soak

MOVE = 1e-3


@pytest.mark.slow
@pytest.mark.parametrize(
    ("seed", "kind", "fog_gap_s", "each"),
    rows_rest_in_soak(
        [
            (100_002, "rocking", (8.0, 10.0), 6),
            (100_002, "rocking", (8.0, 10.0), 1),
            (100_009, "spin", None, 1),
        ]
    ),
    ids=["every sixth, a FOG with a gap", "all, a FOG with a gap", "all, gyros alone"],
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
    for place in range(0, len(middle), each):
        row = torch.zeros_like(middle)
        row[place] = MOVE
        above, below = (network_tasks.at_row(trainer, point, middle + sign * row) for sign in (1, -1))
        said = (trainer.loss(above) - trainer.loss(below)) / (4 * MOVE)
        allowed = 1e-3 * abs(said) + 5e-3 * float(one_error[place]) + 1e-4
        assert float(point.slope[place]) == pytest.approx(said, abs=allowed), place


def test_the_best_state_is_where_the_loss_no_longer_falls():
    task = network_tasks.drawn(100_031, "together", 24.0)
    trainer, start = task.trainer, task.start
    point = network_tasks.settled(trainer, start.raw, start.noise, start.equations.state)
    again = trainer.at(point.raw, point.noise, point.equations.state)
    torch.testing.assert_close(again.equations.state, point.equations.state, rtol=0, atol=1e-8)


@pytest.mark.soak
def test_the_score_of_the_wrong_coefficients_points_back():
    """The slope in each raw parameter is downhill from 30 % above, and from 30 % below."""
    task = network_tasks.drawn(100_009, "spin", 30.0)
    trainer, map_ = task.trainer, task.trainer.map_
    trained = trainer.train(task.start)
    best, noise = map_.values(trained.point.raw), trained.point.noise
    for dof in task.layout.dofs:
        for factor in (1.3, 0.7):
            values = best.clone()
            values[dof] *= factor
            there = network_tasks.settled(trainer, map_.raw(values), noise, trained.point.equations.state)
            assert float(there.slope[dof]) * (factor - 1) > 0, (dof, factor)
