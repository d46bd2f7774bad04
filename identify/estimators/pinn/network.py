"""The network: the vehicle's velocity and disturbance at every instant as weights, and the residuals that pull on them.

It has a hidden layer in time, whose units are the hat functions between neighbouring instants (each is three
ReLUs). So a weight is the state at an instant and reaches no further than its neighbours: the curvature of the loss
is block-tridiagonal and all weights are trained at once.

The equations are solved by odd-even (cyclic) reduction, batched (Hockney 1965; Buzbee, Golub and Nielson 1970): n nodes
take log2(n) rounds of small dense products. The way back gives the solution, and the blocks of the inverse on and next
to the diagonal (the selected inverse: Erisman and Tinney 1975).
"""

import os
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from typing import TypeVar

import torch
from torch import Tensor

from identify.estimators.pinn.layout import Balance, Data, balance, bending, between
from identify.estimators.pinn.parameters import Noise, Raw

POSITION_STD, ROUGHNESS = 3e-6, 2e-5
"""Standard deviations of the error of straight lines between instants: m or rad; m/s or rad/s."""

FIRST_VELOCITY_STD, FIRST_POSITION_STD = 1.0, 10.0
"""Standard deviations of the first state, about zero: hardly anything is known of it."""

GATE_SIGMA = 6.0
"""A reading is wild if it is further off the network's value than this many standard deviations."""

T = TypeVar("T")

AT_A_TIME = 1024
"""Intervals per stretch on a processor: shorter stretches cost more in calls than they save in memory. A card takes
all at once."""

MOST_CORES = 4
"""The work between the stretches runs on one core alone: more cores than these would wait for it."""


@dataclass(frozen=True)
class Pull:
    """All residuals over their standard deviations, (N, R), and their slopes.

    before, after (N, R, s): slopes in the states at both ends of an interval. The first n rows are the physics, then
    n of the disturbance, x of positions, and C of the readings. std (N, R). wander (N, R): share of the variance that
    comes from a disturbance wandering within the interval. known (N, R): 1, or 0 if nothing was read. owner (R,): the
    axis of each row. positions: x. balance: the physics, unscaled.
    """

    residual: Tensor
    before: Tensor
    after: Tensor
    std: Tensor
    wander: Tensor
    known: Tensor
    owner: Tensor
    positions: int
    balance: Balance


def pull(data: Data, map_: Raw, raw: Tensor, state: Tensor, noise: Noise) -> Pull:
    """Residuals and slopes at `raw` (p,) and `state` (N + 1, s)."""
    n, count, placed = data.axes, len(data.step_s), list(data.placed)
    x, width = len(placed), state.shape[1]
    h = data.step_s[:, None]
    given = map_.coefficients(raw)
    momentum = balance(data, given, state)
    density = 2 * noise.disturbance**2 / noise.time_constant_s
    mass = given.mass[list(data.dofs)]
    first, second = state[:-1], state[1:]
    owner = torch.tensor([*range(n), *range(n), *placed, *data.channel_axis.tolist()], device=state.device)
    position, reading = slice(2 * n, 2 * n + x), slice(2 * n + x, None)

    kept = torch.exp(-h / noise.time_constant_s)
    sensor = (data.scale * noise.sensor) ** 2
    wander = torch.zeros(count, len(owner), dtype=state.dtype, device=state.device)
    wander[:, :n] = density * h**3 / 12
    wander[:, position] = (density / mass**2)[placed] * h**5 / 720
    wander[:, reading] = (density / mass**2)[data.channel_axis] * data.open
    fixed = torch.cat(
        [
            ((ROUGHNESS * mass) ** 2).expand(count, n),
            noise.disturbance**2 * (1 - kept**2),
            torch.full((count, x), POSITION_STD**2, dtype=state.dtype, device=state.device),
            sensor,
        ],
        dim=1,
    )
    variance = wander + fixed
    present = torch.ones_like(variance)
    present[:, reading] = data.known.to(variance)

    # These rows depend on mass: the velocity swings under the thrust and bends under the disturbance.
    rows = owner[2 * n :]
    bent = torch.cat([-(h**2) / 12 * torch.ones_like(wander[:, position]), data.bent], dim=1) / mass[rows]
    swung = torch.cat([-0.5 * h * torch.ones_like(wander[:, position]), data.swung], dim=1)
    swung = swung * data.swing[:, rows] / mass[rows]
    bend = bent[:, :, None] * bending(data, given.damping, width)[rows]
    straight_before, straight_after = _straight(data, kept, width)
    before = torch.cat([momentum.before, straight_before[:, :n], straight_before[:, n:] + bend], dim=1)
    after = torch.cat([momentum.after, straight_after[:, :n], straight_after[:, n:] - bend], dim=1)

    read = torch.einsum("nrs,ns->nr", before[:, n:], first) + torch.einsum("nrs,ns->nr", after[:, n:], second)
    value = torch.cat([torch.zeros_like(wander[:, position]), data.value], dim=1)
    residual = torch.cat([momentum.residual, read[:, :n], read[:, n:] + swung - value], dim=1)
    std = variance.sqrt()
    weight = present / std
    return Pull(
        residual * weight,
        before * weight[:, :, None],
        after * weight[:, :, None],
        std,
        wander / variance,
        present,
        owner,
        x,
        momentum,
    )


def _straight(data: Data, kept: Tensor, width: int) -> tuple[Tensor, Tensor]:
    """Slopes (N, n + x + C, s) of all residuals but the physics' in the states at both ends, for a velocity that does
    not bend; the disturbance keeps the share `kept` (N, n)."""
    n, placed, x = data.axes, list(data.placed), len(data.placed)
    before = torch.zeros(len(kept), n + x + data.value.shape[1], width, dtype=kept.dtype, device=kept.device)
    after = torch.zeros_like(before)
    each, integral = torch.arange(n, device=kept.device), torch.arange(x, device=kept.device)
    before[:, each, n + each], after[:, each, n + each] = -kept, torch.ones_like(kept)
    before[:, n + integral, 2 * n + integral], after[:, n + integral, 2 * n + integral] = -1.0, 1.0
    before[:, n + integral, placed] = after[:, n + integral, placed] = -0.5 * data.step_s[:, None]
    before[:, n + x :], after[:, n + x :] = data.before, data.after
    return before, after


def first_precision(noise: Noise, placed: int) -> Tensor:
    """One over the variance of the first state, (s,)."""
    d = noise.disturbance**-2.0
    return torch.cat(
        [
            torch.full_like(d, FIRST_VELOCITY_STD**-2.0),
            d,
            torch.full((placed,), FIRST_POSITION_STD**-2.0, dtype=d.dtype, device=d.device),
        ]
    )


def expected_squares(pulled: Pull, on: Tensor, adjacent: Tensor) -> tuple[Tensor, Tensor, Tensor]:
    """Expected squares of the residuals, (N, R), over the network's own uncertainty, with the blocks `on` and
    `adjacent` the diagonal of its covariance; and half the slopes (N, R, s) of their sum in the pull's `before` and
    `after`."""
    before, after = pulled.before, pulled.after
    by_before = before @ on[:-1] + after @ adjacent.mT
    by_after = before @ adjacent + after @ on[1:]
    spread = (by_before * before).sum(dim=2) + (by_after * after).sum(dim=2)
    return pulled.residual**2 + spread, by_before, by_after


def shortfall(pulled: Pull, squares: Tensor, axes: int) -> tuple[Tensor, Tensor]:
    """Shortfall of the expected `squares`: `sensor` and `wander` of `noise.Moments`."""
    short = (pulled.known - squares) * (pulled.known > 0)
    thrown, read = (short * pulled.wander).sum(dim=0), (short * (1 - pulled.wander)).sum(dim=0)
    zero = torch.zeros(axes, dtype=squares.dtype, device=squares.device)
    return read[2 * axes + pulled.positions :], zero.index_add(0, pulled.owner, thrown)


def of_disturbance(state: Tensor, on: Tensor, adjacent: Tensor, n: int) -> tuple[Tensor, Tensor]:
    """Expected squares (N + 1, n) of the disturbance, and its products (N, n) from one instant to the next."""
    d = state[:, n : 2 * n]
    squares = on.diagonal(dim1=1, dim2=2)[:, n : 2 * n] + d**2
    return squares, adjacent.diagonal(dim1=1, dim2=2)[:, n : 2 * n] + d[:-1] * d[1:]


def spent(pulled: Pull) -> Tensor:
    """Twice the sum of the logarithms of the residuals' standard deviations."""
    return 2 * (pulled.std.log() * pulled.known).sum()


def wild(data: Data, map_: Raw, raw: Tensor, noise: Noise, state: Tensor) -> Tensor:
    """Readings (N, C) that are off the network's value by more than GATE_SIGMA."""
    rows = slice(-data.value.shape[1], None)

    def off(some: Stretch) -> Tensor:
        return (
            pull(between(data, some.intervals), map_, raw, state[some.nodes], noise).residual[:, rows].abs()
        )

    return torch.cat(worked(off, stretches(len(data.value), state.device))) > GATE_SIGMA


def without(data: Data, wild: Tensor) -> Data:
    """The data without the readings (N, C) that are wild."""
    return replace(data, known=data.known & ~wild)


@dataclass(frozen=True)
class Stretch:
    """Some intervals: `before` and `after` are the nodes at their two ends, `nodes` both."""

    before: slice
    after: slice

    @property
    def intervals(self) -> slice:
        return self.before

    @property
    def nodes(self) -> slice:
        return slice(self.before.start, self.after.stop)


def stretches(count: int, device: torch.device) -> list[Stretch]:
    """Stretches that cover `count` intervals, in order."""
    each = AT_A_TIME if device.type == "cpu" else max(count, 1)
    ends = [(start, min(start + each, count)) for start in range(0, count, each)]
    return [Stretch(slice(start, stop), slice(start + 1, stop + 1)) for start, stop in ends]


def worked(work: Callable[[Stretch], T], over: list[Stretch]) -> list[T]:
    """Results of `work` for each stretch, in order."""
    if len(over) == 1:
        return [work(over[0])]
    with ThreadPoolExecutor(max_workers=min(_cores(), MOST_CORES)) as pool:
        return list(pool.map(work, over))


def _cores() -> int:
    """Number of cores that numerical libraries may use: OMP_NUM_THREADS, or all."""
    setting = os.environ.get("OMP_NUM_THREADS", "")
    return int(setting) if setting.isdecimal() and int(setting) > 0 else (os.cpu_count() or 1)


@dataclass(frozen=True)
class _Round:
    """One round: of (n, m, m) blocks, every second node eliminated.

    inverse (k, m, m) of the eliminated nodes' diagonals; to_before, to_after (k, m, m): inverse times the coupling to
    the node before and the node after (zero if there is none).
    """

    inverse: Tensor
    to_before: Tensor
    to_after: Tensor


@dataclass(frozen=True)
class Factor:
    """The eliminated rounds of a matrix, the inverse of the last node, and the log determinant of the whole."""

    rounds: tuple[_Round, ...]
    last: Tensor
    log_det: Tensor


def factorise(diagonal: Tensor, above: Tensor) -> Factor:
    """Factorise a matrix with blocks `diagonal` (n, m, m) at (i, i) and `above` (n - 1, m, m) at (i, i + 1).

    Raises torch.linalg.LinAlgError if the matrix is not positive definite.
    """
    rounds = []
    log_det = diagonal.new_zeros(())
    while len(diagonal) > 1:
        step, diagonal, above, share = _halved(diagonal, above)
        log_det = log_det + share
        rounds.append(step)
    triangle = torch.linalg.cholesky(diagonal[0])
    log_det = log_det + 2 * triangle.diagonal().log().sum()
    return Factor(tuple(rounds), torch.cholesky_inverse(triangle), log_det)


def _halved(diagonal: Tensor, above: Tensor) -> tuple[_Round, Tensor, Tensor, Tensor]:
    """A round, the blocks `diagonal` and `above` of the remaining nodes, and this round's share of the log
    determinant."""
    odd, even = diagonal[1::2], diagonal[0::2].clone()
    inverse, to_before, to_after, carried = (odd.new_empty(odd.shape) for _ in range(4))
    left = torch.empty_like(inverse)

    def eliminate(some: Stretch) -> Tensor:
        cut = some.intervals
        triangle = torch.linalg.cholesky(odd[cut])
        inverse[cut] = torch.cholesky_inverse(triangle)
        before, after = above[0::2][cut], _padded(above[1::2][cut], len(triangle))
        to_before[cut], to_after[cut] = inverse[cut] @ before.mT, inverse[cut] @ after
        even[cut] -= before @ to_before[cut]
        carried[cut] = after.mT @ to_after[cut]
        left[cut] = before @ to_after[cut]
        share: Tensor = 2 * triangle.diagonal(dim1=-2, dim2=-1).log().sum()
        return share

    log_det = torch.stack(worked(eliminate, stretches(len(odd), odd.device))).sum()
    following = len(even) - 1
    even[1:] -= carried[:following]
    return _Round(inverse, to_before, to_after), even, -left[:following], log_det


def solve(factor: Factor, right: Tensor) -> Tensor:
    """Return x (n, m, k) with matrix x = `right` (n, m, k)."""
    kept = []
    for step in factor.rounds:
        odd, even = right[1::2], right[0::2].clone()
        even[: len(odd)] -= step.to_before.mT @ odd
        even[1:] -= (step.to_after.mT @ odd)[: len(even) - 1]
        kept.append(odd)
        right = even
    x = (factor.last @ right[0])[None]
    for step, odd in zip(reversed(factor.rounds), reversed(kept), strict=True):
        eliminated = step.inverse @ odd - step.to_before @ x[: len(odd)]
        following = x[1 : len(odd) + 1]
        eliminated[: len(following)] -= step.to_after[: len(following)] @ following
        x = _woven(x, eliminated)
    return x


def selected_inverse(factor: Factor) -> tuple[Tensor, Tensor]:
    """Blocks of the inverse at (i, i), (n, m, m), and at (i, i + 1), (n - 1, m, m)."""
    on = factor.last[None]
    above = on[:0]
    for step in reversed(factor.rounds):
        on, above = _doubled(step, on, above)
    return on, above


def _doubled(step: _Round, on: Tensor, adjacent: Tensor) -> tuple[Tensor, Tensor]:
    """Blocks of the inverse including the nodes that a round eliminated, from the blocks without them."""
    count = len(step.inverse)
    new_on = on.new_empty(len(on) + count, *on.shape[1:])
    new_adjacent = on.new_empty(len(on) + count - 1, *on.shape[1:])
    new_on[0::2] = on

    def put_back(some: Stretch) -> None:
        cut, after = some.intervals, some.after
        to_before, to_after = step.to_before[cut], step.to_after[cut]
        first = on[cut]
        second, between = _padded(on[after], len(first)), _padded(adjacent[cut], len(first))
        from_first = -(to_before @ first + to_after @ between.mT)
        from_second = -(to_before @ between + to_after @ second)
        new_on[1::2][cut] = step.inverse[cut] - from_first @ to_before.mT - from_second @ to_after.mT
        new_adjacent[0::2][cut] = from_first.mT
        to_second = new_adjacent[1::2][cut]
        to_second[:] = from_second[: len(to_second)]

    worked(put_back, stretches(count, on.device))
    return new_on, new_adjacent


def _padded(blocks: Tensor, count: int) -> Tensor:
    return torch.cat([blocks, blocks.new_zeros(count - len(blocks), *blocks.shape[1:])])


def _woven(even: Tensor, odd: Tensor) -> Tensor:
    out = even.new_empty(len(even) + len(odd), *even.shape[1:])
    out[0::2], out[1::2] = even, odd
    return out
