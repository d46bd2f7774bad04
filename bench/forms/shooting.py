"""Multiple shooting (Bock and Plitt 1984) with a learnt disturbance, trained by gradient steps.

Short segments are integrated in parallel, each from its own initial state; a penalty pulls the end of each segment to
the start of the next. The disturbance is free at its own instants, as the white innovations of its prior.
"""

import torch
from torch import Tensor, nn

from bench.forms.disturbance import Disturbance
from bench.forms.integration import integrated
from bench.forms.physics import Coefficients, accelerations, misfit
from bench.forms.task import STEP_S, Task
from bench.forms.training import Budget, Fitted, by_adam, by_lbfgs, values_of

SEGMENT_STEPS = 50
EVERY = 1
FINEST = 3e-4
FINE_M_S = 1e-3
PENALTY_STD = 3e-4
RATE, COEFFICIENT_RATE = 1e-2, 1.0
ADAM_SHARE = 0.1


def fit(task: Task, seconds: float) -> Fitted:
    """Fit the coefficients by multiple shooting."""
    budget = Budget(seconds)
    given = Coefficients(task)
    segments = -(-task.steps // SEGMENT_STEPS)
    disturbance = Disturbance(task, EVERY)
    white = nn.Parameter(torch.zeros(disturbance.instants, len(task.dofs), dtype=torch.float64))
    starts = nn.Parameter(task.seen[: segments * SEGMENT_STEPS : SEGMENT_STEPS].contiguous() / FINE_M_S)
    places = places_of(task.steps, segments)
    others = task.others[places]

    def loss() -> Tensor:
        drive = given.drive(disturbance.at_halves(disturbance.coloured(white)))
        start = FINE_M_S * starts
        path = integrated(start, drive[places], given.mass, given.damping, others, task.dofs, STEP_S)
        nu = torch.cat([path[:, :-1].flatten(0, 1), path[-1, -1:]])[: task.steps + 1]
        rate = accelerations(task, given, nu, drive[::2], task.others[::2])
        gap = (path[:-1, -1] - start[1:]) / PENALTY_STD
        return (
            misfit(task, nu, rate, FINEST)
            + 0.5 * white.square().sum()
            + 0.5 * gap.square().sum()
            + given.prior()
        )

    groups = [([white], RATE), ([starts], RATE), (list(given.parameters()), COEFFICIENT_RATE)]
    _, first = by_adam(loss, groups, budget, ADAM_SHARE)
    reason, steps = by_lbfgs(loss, [white, starts, *given.parameters()], budget)
    return Fitted(values_of(given, task.dofs), reason, first + steps, budget.spent_s)


def places_of(steps: int, segments: int) -> Tensor:
    """Places (S, 2 L + 1) of each segment's instants and midpoints in the task; past the end, the last place
    repeats."""
    at = torch.arange(2 * SEGMENT_STEPS + 1) + 2 * SEGMENT_STEPS * torch.arange(segments)[:, None]
    return at.clamp_max(2 * steps)
