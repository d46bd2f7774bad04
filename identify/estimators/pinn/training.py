"""Weights and coefficients trained together, by Gauss and Newton, until none moves by a share of its own error.

First an approach: Fisher's scoring for the coefficients, expectation-maximisation for the noise levels. Then, near
the end, Newton's steps for both at once, with the curvature as measured; its inverse gives the intervals.
"""

from collections.abc import Callable
from dataclasses import dataclass

import torch
from torch import Tensor

from identify.estimators.pinn.curvature import curvature_of
from identify.estimators.pinn.equations import Equations, equations
from identify.estimators.pinn.network import Data, Raw
from identify.estimators.pinn.noise import Noise, of_logarithm, slope, updated

CLOSE = 1.0
"""The approach ends once no coefficient moves by more than this many standard errors, or after MOST_APPROACHES."""

SETTLED = 0.05
"""Training ends once no coefficient would move by more than this share of its standard error, """

PATIENCE, FLAT = 3, 0.1
"""or once the loss fell by less than FLAT (a twentieth of what one standard error costs) in so many passes."""

MOST_APPROACHES, MOST_PASSES = 25, 30
RENEW = 5
"""Passes after which the curvature is measured anew."""

LARGEST_MOVE, LARGEST_LEAP = 0.7, 0.5
"""Of a raw parameter, and of the logarithm of a noise level, in one pass."""

UPHILL, LEAST_SHARE = 0.02, 0.03
"""What the loss may rise by in a pass, and the smallest share of a step that is tried against more."""


@dataclass(frozen=True)
class Prior:
    """Of the noise levels: log-normal about `middle`; `sensor_spread` (C,) of the sensors'."""

    middle: Noise
    sensor_spread: Tensor


@dataclass(frozen=True)
class Point:
    """Where training is: raw parameters (p,), noise, and the equations there with their best state."""

    raw: Tensor
    noise: Noise
    equations: Equations


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
    """Where training stopped, and why; curvature (p + C + 2 n,) squared, of raw parameters and noise levels."""

    point: Point
    curvature: Tensor
    passes: int
    settled: bool
    reason: str


Watch = Callable[[Pass], None]


def begin(data: Data, map_: Raw, raw: Tensor, noise: Noise, state: Tensor) -> Point:
    """The point at first values; `state` (N + 1, s) need only be near."""
    return Point(raw, noise, equations(data, map_, raw, state, noise))


def approach(data: Data, map_: Raw, point: Point, prior: Prior, watch: Watch) -> Point:
    """Come near: by scoring and expectation-maximisation, until no coefficient moves far."""
    for number in range(1, MOST_APPROACHES + 1):
        here = point.equations
        covariance = torch.linalg.inv(here.information + here.prior)
        move = -covariance @ here.gradient
        moved = _moved(move, covariance)
        newer = updated(here.moments, data.interval.step_s, prior.middle, prior.sensor_spread)
        step = newer.logarithm() - point.noise.logarithm()
        point = _stepped(data, map_, point, move, step)
        watch(Pass(number, point, covariance, moved))
        if moved < CLOSE:
            break
    return point


def settle(data: Data, map_: Raw, point: Point, prior: Prior, watch: Watch) -> Trained:
    """Go on to the end from a near point, by Newton's steps."""
    losses = [point.equations.loss]
    curvature = None
    for number in range(1, MOST_PASSES + 1):
        if curvature is None or number % RENEW == 0:
            curvature = curvature_of(
                data, map_, point.raw, point.equations, point.noise, prior.middle, prior.sensor_spread
            )
        here, size = point.equations, len(point.raw)
        downhill = slope(here.moments, data.interval.step_s, point.noise, prior.middle, prior.sensor_spread)
        inverse = torch.linalg.inv(curvature)
        both = -inverse @ torch.cat([here.gradient, downhill])
        covariance = inverse[:size, :size]
        moved = _moved(both[:size], covariance)
        if moved < SETTLED:
            reason = f"no coefficient would move by {100 * SETTLED:.0f} % of its standard error"
            return Trained(point, curvature, number, True, reason)
        point = _stepped(data, map_, point, both[:size], both[size:])
        watch(Pass(number, point, covariance, moved))
        losses.append(point.equations.loss)
        if len(losses) > PATIENCE and losses[-1 - PATIENCE] - losses[-1] < FLAT:
            reason = f"the loss fell by less than {FLAT:g} in {PATIENCE} passes"
            return Trained(point, curvature, number, True, reason)
    return Trained(point, curvature, MOST_PASSES, False, f"it had not settled after {MOST_PASSES} passes")


def _moved(move: Tensor, covariance: Tensor) -> float:
    return float((move.abs() / covariance.diagonal().sqrt()).max())


def _stepped(data: Data, map_: Raw, point: Point, move: Tensor, step: Tensor) -> Point:
    """The step of raw parameters and of the noise levels' logarithms, or as much of it as leads down."""
    move = move * min(1.0, LARGEST_MOVE / max(float(move.abs().max()), 1e-12))
    step = step.clamp(-LARGEST_LEAP, LARGEST_LEAP)
    share, here = 1.0, point.equations
    while True:
        raw = point.raw + share * move
        noise = of_logarithm(point.noise.logarithm() + share * step, data.axes)
        there = Point(raw, noise, equations(data, map_, raw, here.state - share * here.leaning @ move, noise))
        if there.equations.loss < here.loss + UPHILL or share < LEAST_SHARE:
            return there
        share /= 3
