"""Symmetric block-tridiagonal equations by odd-even (cyclic) reduction, batched: the same lines on CPU and CUDA.

Every second node is eliminated at once, and again among those left (Hockney 1965; Buzbee, Golub and Nielson 1970),
so n nodes take log2(n) rounds of small dense products. The way back gives the solution, and the blocks of the
inverse on and beside the diagonal (the selected inverse: Erisman and Tinney 1975).
"""

from dataclasses import dataclass

import torch
from torch import Tensor


@dataclass(frozen=True)
class _Round:
    """One round: of (n, m, m) blocks, every second node eliminated.

    inverse (k, m, m) of the eliminated nodes' diagonals; to_before, to_after (k, m, m): that times their coupling
    to the node before and the node after (zero where there is none).
    """

    inverse: Tensor
    to_before: Tensor
    to_after: Tensor


@dataclass(frozen=True)
class Factor:
    """The eliminated rounds of a matrix, the inverse of the one node left, and the log determinant of all."""

    rounds: tuple[_Round, ...]
    last: Tensor
    log_det: Tensor


def factorise(diagonal: Tensor, above: Tensor) -> Factor:
    """`diagonal` (n, m, m), `above` (n - 1, m, m): the blocks at (i, i) and (i, i + 1).

    Raises torch.linalg.LinAlgError where the matrix is not positive definite.
    """
    rounds = []
    log_det = diagonal.new_zeros(())
    while len(diagonal) > 1:
        odd, even = diagonal[1::2], diagonal[0::2].clone()
        triangle = torch.linalg.cholesky(odd)
        log_det = log_det + 2 * triangle.diagonal(dim1=-2, dim2=-1).log().sum()
        inverse = torch.cholesky_inverse(triangle)
        before = above[0::2]
        after = torch.zeros_like(odd)
        after[: len(above[1::2])] = above[1::2]
        to_before, to_after = inverse @ before.mT, inverse @ after
        even[: len(odd)] -= before @ to_before
        following = len(even) - 1
        even[1:] -= (after.mT @ to_after)[:following]
        above = -(before @ to_after)[:following]
        diagonal = even
        rounds.append(_Round(inverse, to_before, to_after))
    triangle = torch.linalg.cholesky(diagonal[0])
    log_det = log_det + 2 * triangle.diagonal().log().sum()
    return Factor(tuple(rounds), torch.cholesky_inverse(triangle), log_det)


def solve(factor: Factor, right: Tensor) -> Tensor:
    """x (n, m, k) with matrix x = `right` (n, m, k)."""
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
    """The inverse's blocks at (i, i), (n, m, m), and at (i, i + 1), (n - 1, m, m)."""
    on = factor.last[None]
    beside = on[:0]
    for step in reversed(factor.rounds):
        count = len(step.inverse)
        first = on[:count]
        second = _padded(on[1 : count + 1], count)
        between = _padded(beside[:count], count)
        from_first = -(step.to_before @ first + step.to_after @ between.mT)
        from_second = -(step.to_before @ between + step.to_after @ second)
        own = step.inverse - from_first @ step.to_before.mT - from_second @ step.to_after.mT
        new_beside = _woven(from_first.mT, from_second)[: len(on) + count - 1]
        on, beside = _woven(on, own), new_beside
    return on, beside


def _padded(blocks: Tensor, count: int) -> Tensor:
    return torch.cat([blocks, blocks.new_zeros(count - len(blocks), *blocks.shape[1:])])


def _woven(even: Tensor, odd: Tensor) -> Tensor:
    out = even.new_empty(len(even) + len(odd), *even.shape[1:])
    out[0::2], out[1::2] = even, odd
    return out
