"""The coupled LSTM: the source paper's network, changed to output the state on which its physics is evaluated.

Windows of thrust and measured velocity go in, and the velocity comes out. Its finite differences in time, not those
of the sensors, go into Fossen's equations. The residual of these is the disturbance, held to its prior.
"""

import torch
from torch import Tensor, nn

from bench.forms.disturbance import Disturbance
from bench.forms.physics import Coefficients, accelerations, misfit
from bench.forms.task import STEP_S, Task
from bench.forms.training import Budget, Fitted, by_adam, values_of

WINDOW, OVERLAP = 150, 40
HIDDEN = 64
CORRECTION = 0.02
RATE, COEFFICIENT_RATE = 3e-3, 1.0
FINEST = 3e-4


class StateNetwork(nn.Module):
    """Velocity (N + 1, n) from windows of thrust and measured velocity: the measurement plus a learnt correction."""

    def __init__(self, task: Task) -> None:
        super().__init__()
        n = len(task.dofs)
        self._seen, self._count = task.seen, task.steps + 1
        windows = -(-self._count // WINDOW)
        force = task.force[::2]
        read = torch.cat([force / force.std(dim=0), task.seen / task.seen.std(dim=0)], dim=1).float()
        place = torch.arange(WINDOW + 2 * OVERLAP) - OVERLAP + WINDOW * torch.arange(windows)[:, None]
        self._inputs = read[place.clamp(0, task.steps)]
        self.lstm = nn.LSTM(2 * n, HIDDEN, batch_first=True, bidirectional=True)
        self.head = nn.Linear(2 * HIDDEN, n)
        nn.init.zeros_(self.head.weight)
        nn.init.zeros_(self.head.bias)

    def forward(self) -> Tensor:
        hidden, _ = self.lstm(self._inputs)
        out: Tensor = self.head(hidden[:, OVERLAP : OVERLAP + WINDOW]).flatten(0, 1)[: self._count]
        return self._seen + CORRECTION * out.double()


def fit(task: Task, seconds: float) -> Fitted:
    """Fit the coefficients by the coupled LSTM."""
    budget = Budget(seconds)
    given = Coefficients(task)
    disturbance = Disturbance(task, 1)
    network = StateNetwork(task)

    def loss() -> Tensor:
        nu = network()
        steps = nu.diff(dim=0) / STEP_S
        rate = torch.cat([steps[:1], 0.5 * (steps[1:] + steps[:-1]), steps[-1:]])
        left = steps - accelerations(
            task, given, 0.5 * (nu[1:] + nu[:-1]), mean_drive(task, given), task.others[1::2]
        )
        return misfit(task, nu, rate, FINEST) + disturbance.roughness(left) + given.prior()

    groups: list[tuple[list[nn.Parameter], float]] = [
        (list(network.parameters()), RATE),
        (list(given.parameters()), COEFFICIENT_RATE),
    ]
    reason, steps = by_adam(loss, groups, budget)
    return Fitted(values_of(given, task.dofs), reason, steps, budget.spent_s)


def mean_drive(task: Task, given: Coefficients) -> Tensor:
    """Total force (N, n) without the disturbance, averaged over each step by Simpson's rule."""
    drive = given.drive(task.force.new_zeros(()))
    return (drive[:-2:2] + 4 * drive[1::2] + drive[2::2]) / 6
