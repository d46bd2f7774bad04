"""Weights, coefficients and noise levels trained together, until no coefficient moves by a share of its own error.

Quasi-Newton (Broyden, Fletcher, Goldfarb and Shanno 1970): the weights are solved for in every pass, so that the loss
is one of coefficients and noise levels alone, with an exact slope. At the end its curvature is asked for anew; the
inverse gives the intervals.
"""

from collections.abc import Callable
from dataclasses import dataclass

import torch
from torch import Tensor

from identify.estimators.pinn.equations import Equations, equations
from identify.estimators.pinn.network import Data, Raw
from identify.estimators.pinn.noise import Noise, of_logarithm, slope

SETTLED = 0.05
"""Training ends once no coefficient would move by more than this share of its standard error, """

PATIENCE, FLAT = 4, 0.02
"""or once the loss fell by less than FLAT in so many passes: a hundredth of what one standard error costs."""

MOST_PASSES, MOST_MEASURED = 40, 3

LARGEST_STEP = 1.0
"""Of a raw parameter or the logarithm of a noise level, in one pass."""

UPHILL, LEAST_SHARE = 5e-3, 0.01
"""What the loss may rise by in a pass, and the smallest share of a step that is tried against more."""


@dataclass(frozen=True)
class Prior:
    """Of the noise levels: log-normal about `middle`; `sensor_spread` (C,) of the sensors'."""

    middle: Noise
    sensor_spread: Tensor


@dataclass(frozen=True)
class Point:
    """Where training is: raw parameters (p,), noise, the equations there with their best state, and the slope of half
    the loss in raw parameters and logarithms of noise levels."""

    raw: Tensor
    noise: Noise
    equations: Equations
    slope: Tensor

    def where(self) -> Tensor:
        """Raw parameters, then logarithms of noise levels."""
        return torch.cat([self.raw, self.noise.logarithm()])


@dataclass(frozen=True)
class Pass:
    """One pass: its number, where it led, the covariance (p, p) of the raw parameters, and the largest move of one
    in standard errors."""

    number: int
    point: Point
    covariance: Tensor
    moved: float


@dataclass(frozen=True)
class Trained:
    """Where training stopped, and why; curvature of half the loss there, of raw parameters and noise levels, with
    priors."""

    point: Point
    curvature: Tensor
    passes: int
    settled: bool
    reason: str


@dataclass(frozen=True)
class Trainer:
    """All that stays the same while a network is trained."""

    data: Data
    map_: Raw
    prior: Prior
    curvature_at: Callable[[Point], Tensor]
    watch: Callable[[Pass], None]

    def at(self, raw: Tensor, noise: Noise, state: Tensor) -> Point:
        """The point at these values; `state` (N + 1, s) need only be near."""
        here = equations(self.data, self.map_, raw, state, noise)
        levels = slope(
            here.moments, self.data.interval.step_s, noise, self.prior.middle, self.prior.sensor_spread
        )
        return Point(raw, noise, here, torch.cat([here.gradient, levels]))

    def train(self, point: Point) -> Trained:
        """Train from a point."""
        losses = [self.loss(point)]
        for number in range(1, MOST_PASSES + 1):
            # Once more about the state that the last step led to: its slope is worth a second look.
            point = self.at(point.raw, point.noise, point.equations.state)
            curvature = self.curvature_at(point)
            inverse = torch.linalg.inv(curvature)
            step = -inverse @ point.slope
            covariance = inverse[: len(point.raw), : len(point.raw)]
            moved = float((step[: len(point.raw)].abs() / covariance.diagonal().sqrt()).max())
            flat = len(losses) > PATIENCE and losses[-1 - PATIENCE] - losses[-1] < FLAT
            if moved < SETTLED or flat:
                return Trained(point, curvature, number, True, _reason(moved))
            point = self._down(point, step)
            losses.append(self.loss(point))
            self.watch(Pass(number, point, covariance, moved))
        return Trained(point, curvature, MOST_PASSES, False, "it had not settled")

    def loss(self, point: Point) -> float:
        """Minus twice the logarithm of the probability of readings and priors, but for a constant."""
        return point.equations.loss + self.prior.middle.pull_on(point.noise, self.prior.sensor_spread)

    def _down(self, point: Point, step: Tensor) -> Point:
        """The step, or as much of it as leads down."""
        step = step * min(1.0, LARGEST_STEP / max(float(step.abs().max()), 1e-12))
        count, here = len(point.raw), point.equations
        share = 1.0
        while True:
            move = share * step[:count]
            noise = of_logarithm(point.noise.logarithm() + share * step[count:], self.data.axes)
            there = self.at(point.raw + move, noise, here.state - here.leaning @ move)
            if self.loss(there) < self.loss(point) + UPHILL or share < LEAST_SHARE:
                return there
            share /= 3


def _updated(curvature: Tensor, step: Tensor, answer: Tensor) -> Tensor:
    """The curvature that explains what the slope did, damped so that it stays positive definite (Powell 1978)."""
    along = curvature @ step
    expected, found = float(step @ along), float(step @ answer)
    if expected < 1e-14:
        return curvature
    if found < 0.2 * expected:
        share = 0.8 * expected / (expected - found)
        answer = share * answer + (1 - share) * along
        found = 0.2 * expected
    return curvature + torch.outer(answer, answer) / found - torch.outer(along, along) / expected


def _reason(moved: float) -> str:
    if moved < SETTLED:
        return f"no coefficient would move by {100 * SETTLED:.0f} % of its standard error"
    return f"the loss fell by less than {FLAT:g} in {PATIENCE} passes"
