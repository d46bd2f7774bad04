"""The strong form: the classic physics-informed network (Raissi, Perdikaris and Karniadakis 2019).

A network of time gives the velocity. Its exact derivative enters Fossen's equations at collocation points. The
residual of the equations is the disturbance, and its prior weights it, so that no weight between data and physics has
to be chosen.
"""

import torch
from torch import Tensor, nn

from bench.forms.disturbance import Disturbance
from bench.forms.physics import Coefficients, accelerations, misfit
from bench.forms.task import STEP_S, Task
from bench.forms.training import Budget, Fitted, by_adam, by_lbfgs, values_of
from bench.forms.waves import Waves

HIGHEST_HZ, CORNER_HZ, FALL = 8.0, 0.3, 2.0
WIDTH = 64
RATE, COEFFICIENT_RATE = 3e-3, 1.0
ADAM_SHARE = 0.8
FINEST = 3e-4


def fit(task: Task, seconds: float) -> Fitted:
    """Fit the coefficients by the strong form."""
    budget = Budget(seconds)
    given = Coefficients(task)
    disturbance = Disturbance(task, 1)
    corner_hz = torch.full((len(task.dofs),), CORNER_HZ, dtype=torch.float64)
    network = Waves(task.steps, STEP_S, HIGHEST_HZ, corner_hz, FALL, WIDTH)
    scale = task.seen.square().mean(dim=0).sqrt()
    network.begin_at(task.seen / scale)

    def loss() -> Tensor:
        value, slope = network()
        nu, rate = scale * value, scale * slope
        drive = given.drive(task.force.new_zeros(()))[::2]
        left = rate - accelerations(task, given, nu, drive, task.others[::2])
        return misfit(task, nu, rate, FINEST) + disturbance.roughness(left) + given.prior()

    weights = list(network.parameters())
    groups: list[tuple[list[nn.Parameter], float]] = [
        (weights, RATE),
        (list(given.parameters()), COEFFICIENT_RATE),
    ]
    _, first = by_adam(loss, groups, budget, ADAM_SHARE)
    reason, steps = by_lbfgs(loss, [*weights, *given.parameters()], budget)
    return Fitted(values_of(given, task.dofs), reason, first + steps, budget.spent_s)
