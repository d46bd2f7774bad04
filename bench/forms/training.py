"""Training by gradient steps within a time budget, with a schedule, an early stop and the reason for stopping."""

import math
import time
from collections.abc import Callable
from dataclasses import dataclass

import torch
from torch import Tensor, nn

from bench.forms.physics import Coefficients
from bridge.vehicle.coefficients import DAMPINGS, MASSES

SETTLED = "settled"
OUT_OF_TIME = "time was up"

SPAN, PATIENCE = 50, 20
LEAST_FALL = 0.02
"""Least fall of the loss (half of squared standard deviations); settled: PATIENCE spans in a row bring less."""

MEMORY, PORTION = 30, 20
"""Pairs that L-BFGS keeps, and the number of steps in one of its spans."""


@dataclass(frozen=True)
class Fitted:
    """Result of a form: coefficients by name, why training ended, its steps and its CPU seconds."""

    values: dict[str, float]
    reason: str
    steps: int
    seconds: float


@dataclass
class Budget:
    """Budget of CPU seconds of this process, so that a busy machine takes nothing from a form."""

    seconds: float

    def __post_init__(self) -> None:
        self._began = time.process_time()

    @property
    def spent_s(self) -> float:
        return time.process_time() - self._began

    @property
    def is_over(self) -> bool:
        return self.spent_s >= self.seconds


def values_of(given: Coefficients, dofs: tuple[int, ...]) -> dict[str, float]:
    """Masses and dampings of the fitted axes by name."""
    mass, damping = given.mass.tolist(), given.damping.tolist()
    masses = {MASSES[dof].name: mass[dof] for dof in dofs}
    return masses | {DAMPINGS[dof].name: damping[axis] for axis, dof in enumerate(dofs)}


def by_adam(
    loss: Callable[[], Tensor],
    groups: list[tuple[list[nn.Parameter], float]],
    budget: Budget,
    share: float = 1.0,
) -> tuple[str, int]:
    """Run Adam over the `share` of the budget; return why it ended, and its steps.

    Every group has its own rate; all rates fall as a cosine. Training ends early once the mean loss of a span no
    longer falls.
    """
    optimiser = torch.optim.Adam([{"params": parameters, "lr": rate} for parameters, rate in groups])
    began, end = budget.spent_s, share * budget.seconds
    steps, total, best, spans = 0, 0.0, math.inf, 0
    while budget.spent_s < end:
        fall = 0.5 * (1 + math.cos(math.pi * (budget.spent_s - began) / (end - began)))
        for group, (_, rate) in zip(optimiser.param_groups, groups, strict=True):
            group["lr"] = rate * (0.01 + 0.99 * fall)
        optimiser.zero_grad()
        value = loss()
        value.backward()  # type: ignore[no-untyped-call]
        optimiser.step()
        steps += 1
        total += float(value.detach())
        if steps % SPAN == 0:
            spans = 0 if total / SPAN < best - LEAST_FALL else spans + 1
            best, total = min(best, total / SPAN), 0.0
            if spans >= PATIENCE:
                return SETTLED, steps
    return OUT_OF_TIME, steps


def by_lbfgs(loss: Callable[[], Tensor], parameters: list[nn.Parameter], budget: Budget) -> tuple[str, int]:
    """Run L-BFGS with a strong Wolfe search (Liu and Nocedal 1989) and MEMORY pairs; return why it ended, and its
    steps."""
    optimiser = torch.optim.LBFGS(
        parameters, max_iter=PORTION, history_size=MEMORY, tolerance_change=0.0, tolerance_grad=0.0,
        line_search_fn="strong_wolfe",
    )  # fmt: skip
    steps, last, spans = 0, math.inf, 0

    def slope() -> Tensor:
        optimiser.zero_grad()
        value = loss()
        value.backward()  # type: ignore[no-untyped-call]
        return value

    while not budget.is_over:
        value = float(optimiser.step(slope).detach())  # type: ignore[no-untyped-call]
        steps += PORTION
        spans = 0 if value < last - LEAST_FALL else spans + 1
        last = min(last, value)
        if spans >= PATIENCE:
            return SETTLED, steps
    return OUT_OF_TIME, steps
