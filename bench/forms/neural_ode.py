"""The neural ODE: one integration through the whole dive, with a network of time as its disturbance.

After Chen, Rubanova, Bettencourt and Duvenaud (2018), with the slope by the discrete adjoint of the integration.
"""

import math

from torch import Tensor, nn

from bench.forms.disturbance import Disturbance
from bench.forms.integration import integrated
from bench.forms.physics import Coefficients, accelerations, misfit
from bench.forms.task import STEP_S, Task
from bench.forms.training import Budget, Fitted, by_adam, by_lbfgs, values_of
from bench.forms.waves import Waves

HIGHEST_HZ, FALL = 5.0, 1.0
EVERY = 2
WIDTH = 16
FINEST = 3e-4
ADAM_SHARE = 0.5
RATE, COEFFICIENT_RATE = 5e-2, 2.0


def fit(task: Task, seconds: float) -> Fitted:
    """Fit the coefficients by a neural ODE."""
    budget = Budget(seconds)
    given = Coefficients(task)
    disturbance = Disturbance(task, EVERY)
    corner_hz = 1 / (2 * math.pi * task.disturbance_time_s)
    network = Waves(disturbance.instants - 1, EVERY * STEP_S, HIGHEST_HZ, corner_hz, FALL, WIDTH)
    start = nn.Parameter(task.seen[0].clone())

    def loss() -> Tensor:
        slow = task.disturbance_std * network()[0]
        drive = given.drive(disturbance.at_halves(slow))
        path = integrated(
            start[None], drive[None], given.mass, given.damping, task.others[None], task.dofs, STEP_S
        )[0]
        rate = accelerations(task, given, path, drive[::2], task.others[::2])
        return misfit(task, path, rate, FINEST) + disturbance.roughness(slow) + given.prior()

    groups = [
        (list(network.parameters()), RATE),
        ([start], RATE),
        (list(given.parameters()), COEFFICIENT_RATE),
    ]
    _, first = by_adam(loss, groups, budget, ADAM_SHARE)
    reason, steps = by_lbfgs(loss, [p for parameters, _ in groups for p in parameters], budget)
    return Fitted(values_of(given, task.dofs), reason, first + steps, budget.spent_s)
