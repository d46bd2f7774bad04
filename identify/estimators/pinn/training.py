"""Trains coefficients and noise levels with the weights, until no coefficient moves by a set share of its own
standard error.

Fisher scoring: the weights are solved for in every pass, so that the loss depends on coefficients and noise levels
alone, with a slope of its own. The step is that slope over the expected curvature (Gupta and Mehra 1974, IEEE TAC
19(6), eq. 35), corrected by the slope's changes over earlier steps, and shortened if it leads uphill. The inverse of
the last expected curvature gives the intervals.
"""

from collections.abc import Callable
from dataclasses import dataclass

import torch
from torch import Tensor

from identify.estimators.pinn.equations import Equations, equations
from identify.estimators.pinn.network import Data
from identify.estimators.pinn.raw import Noise, Prior, Raw, of_logarithm, slope

SETTLED, LEVELS_SETTLED, LEVEL_SHARE = 0.1, 1.0, 0.02
"""Training ends with a step in which no coefficient moves by more than SETTLED of its standard error, and no noise
level by more than LEVELS_SETTLED of its own or LEVEL_SHARE of itself. The remaining error is then several times
smaller."""

PATIENCE, FLAT = 4, 0.02
"""Training also ends once the loss fell by less than FLAT in PATIENCE passes: a fiftieth of the cost of one standard
error."""

SETTLED_TEXT = f"no coefficient moved by {100 * SETTLED:.0f} % of its standard error in the last pass"
FLAT_TEXT = f"the loss fell by less than {FLAT:g} in {PATIENCE} passes"

MOST_PASSES = 40
"""Passes for a dive, over all its trainings."""

UNSETTLED_TEXT = f"the network had not settled after {MOST_PASSES} passes"

NEAR = 1.0
"""Standard errors: the slope's change over a longer step says little about the curvature at the end."""

LARGEST_STEP = 1.0
"""Largest change of a raw parameter or of the logarithm of a noise level in one pass."""

UPHILL, LEAST_SHARE = 5e-3, 0.01
"""Largest rise of the loss that is accepted in a pass, and the smallest share of a step that is tried against a
larger rise."""


@dataclass(frozen=True)
class Point:
    """A point of training: raw parameters (p,), noise, the equations there with their best state, and the slope of
    half the loss in raw parameters and logarithms of noise levels."""

    raw: Tensor
    noise: Noise
    equations: Equations
    slope: Tensor

    def where(self) -> Tensor:
        """Raw parameters, then logarithms of noise levels."""
        return torch.cat([self.raw, self.noise.logarithm()])


@dataclass(frozen=True)
class Pass:
    """A pass: its point, and the covariance (p, p) of the raw parameters there."""

    point: Point
    covariance: Tensor


@dataclass(frozen=True)
class Trained:
    """End of training, and the reason for it.

    point: the last that was evaluated. raw (p,): the raw parameters after a last small step from there. curvature,
    told (p + C + 2 n,) squared: curvature of half the loss there, in raw parameters and logarithms of noise levels,
    with the priors and without.
    """

    point: Point
    raw: Tensor
    curvature: Tensor
    told: Tensor
    passes: int
    settled: bool
    reason: str


@dataclass(frozen=True)
class Trainer:
    """Everything that stays the same while a network is trained.

    curvature_at: the expected curvature of half the loss without priors, ordered as `Point.where`. watch: called at
    every pass.
    """

    data: Data
    map_: Raw
    prior: Prior
    curvature_at: Callable[[Point], Tensor]
    watch: Callable[[Pass], None]

    def at(self, raw: Tensor, noise: Noise, state: Tensor) -> Point:
        """The point at these values; `state` (N + 1, s) need only be near its best."""
        here = equations(self.data, self.map_, raw, state, noise)
        levels = slope(here.moments, self.data.interval.step_s, noise)
        levels = levels + self.prior.residual(noise) / self.prior.spread()
        return Point(raw, noise, here, torch.cat([here.gradient, levels]))

    def train(self, point: Point, most_passes: int = MOST_PASSES) -> Trained:
        """Train from a point, in at most `most_passes` passes and at least one."""
        count, losses = len(point.raw), [self.loss(point)]
        pairs: list[tuple[Tensor, Tensor]] = []
        for number in range(1, most_passes + 1):
            by_data = self.curvature_at(point)
            curvature = by_data + torch.diag(self._precision(point))
            inverse = torch.linalg.inv(curvature)
            self.watch(Pass(point, inverse[:count, :count]))
            step = -_bent(inverse, pairs) @ point.slope
            moved = step.abs() / inverse.diagonal().sqrt()
            still = (moved[count:] < LEVELS_SETTLED) | (step[count:].abs() < LEVEL_SHARE)
            if float(moved[:count].max()) < SETTLED and bool(still.all()):
                return Trained(
                    point, point.raw + step[:count], curvature, by_data, number, True, SETTLED_TEXT
                )
            if len(losses) > PATIENCE and 0 <= losses[-1 - PATIENCE] - losses[-1] < FLAT:
                return Trained(point, point.raw, curvature, by_data, number, True, FLAT_TEXT)
            before, point = point, self._down(point, step)
            pairs.append((point.where() - before.where(), point.slope - before.slope))
            if float(moved[:count].max()) > NEAR:
                pairs.clear()
            losses.append(self.loss(point))
        return Trained(point, point.raw, curvature, by_data, most_passes, False, UNSETTLED_TEXT)

    def loss(self, point: Point) -> float:
        """Minus twice the logarithm of the probability of readings and priors, up to a constant."""
        return point.equations.loss + self._cost(point.noise)

    def _cost(self, noise: Noise) -> float:
        return float((self.prior.residual(noise) ** 2).sum())

    def _precision(self, point: Point) -> Tensor:
        """The priors' part of the curvature: its diagonal."""
        return torch.cat([point.equations.tilt**2, self.prior.spread() ** -2])

    def _down(self, point: Point, step: Tensor) -> Point:
        """The point after the step, or after the largest share of it that leads downhill."""
        step = step * min(1.0, LARGEST_STEP / max(float(step.abs().max()), 1e-12))
        count, share = len(point.raw), 1.0
        while True:
            noise = of_logarithm(point.noise.logarithm() + share * step[count:], self.data.axes)
            tried = self.at(point.raw + share * step[:count], noise, point.equations.state)
            if self.loss(tried) < self.loss(point) + UPHILL or share < LEAST_SHARE:
                return tried
            share /= 3


def _bent(inverse: Tensor, pairs: list[tuple[Tensor, Tensor]]) -> Tensor:
    """The inverse curvature corrected by the slope's changes over the steps so far; `pairs` of a step and the slope's
    change.

    If a disturbance drives an axis, the expected curvature is larger than the loss's own, and steps by it alone would
    be too short (Nocedal and Wright 2006, eq. 6.17: Broyden, Fletcher, Goldfarb and Shanno).
    """
    eye = torch.eye(len(inverse), dtype=inverse.dtype, device=inverse.device)
    for step, change in pairs:
        along = step @ change
        if along > 0:
            across = eye - torch.outer(step, change) / along
            inverse = across @ inverse @ across.mT + torch.outer(step, step) / along
    return inverse
