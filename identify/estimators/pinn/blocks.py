"""Solves symmetric block-tridiagonal equations by odd-even (cyclic) reduction, batched: the same code on CPU and CUDA.

Every second node is eliminated at once, and again among those left (Hockney 1965; Buzbee, Golub and Nielson 1970), so
n nodes take log2(n) rounds of small dense products. The way back gives the solution, and the blocks of the inverse on
and next to the diagonal (the selected inverse: Erisman and Tinney 1975).

Processes the intervals of a dive in stretches that fit a core's cache, on several cores.
"""

import os
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import TypeVar

import torch
from torch import Tensor

T = TypeVar("T")

AT_A_TIME = 1024
"""Intervals per stretch on a processor: shorter stretches cost more in calls than they save in memory. A card takes
all at once."""

MOST_CORES = 4
"""The work between the stretches runs on one core alone: more cores than these would wait for it."""


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


def _doubled(step: _Round, on: Tensor, beside: Tensor) -> tuple[Tensor, Tensor]:
    """Blocks of the inverse including the nodes that a round eliminated, from the blocks without them."""
    count = len(step.inverse)
    new_on = on.new_empty(len(on) + count, *on.shape[1:])
    new_beside = on.new_empty(len(on) + count - 1, *on.shape[1:])
    new_on[0::2] = on

    def put_back(some: Stretch) -> None:
        cut, after = some.intervals, some.after
        to_before, to_after = step.to_before[cut], step.to_after[cut]
        first = on[cut]
        second, between = _padded(on[after], len(first)), _padded(beside[cut], len(first))
        from_first = -(to_before @ first + to_after @ between.mT)
        from_second = -(to_before @ between + to_after @ second)
        new_on[1::2][cut] = step.inverse[cut] - from_first @ to_before.mT - from_second @ to_after.mT
        new_beside[0::2][cut] = from_first.mT
        to_second = new_beside[1::2][cut]
        to_second[:] = from_second[: len(to_second)]

    worked(put_back, stretches(count, on.device))
    return new_on, new_beside


def _padded(blocks: Tensor, count: int) -> Tensor:
    return torch.cat([blocks, blocks.new_zeros(count - len(blocks), *blocks.shape[1:])])


def _woven(even: Tensor, odd: Tensor) -> Tensor:
    out = even.new_empty(len(even) + len(odd), *even.shape[1:])
    out[0::2], out[1::2] = even, odd
    return out
