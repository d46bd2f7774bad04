"""The same work on several things at once, as many as there are processors; kernels hold no lock while they run."""

import os
from collections.abc import Callable, Iterable
from concurrent.futures import ThreadPoolExecutor
from typing import TypeVar

T = TypeVar("T")
R = TypeVar("R")


def side_by_side(work: Callable[[T], R], things: Iterable[T]) -> list[R]:
    """`work` of each thing, in their order; raises what the first that failed raised.

    Its threads end with it: a process that forks later must not inherit a pool whose threads it does not have.
    """
    every = list(things)
    at_once = min(len(os.sched_getaffinity(0)), len(every))
    if at_once < 2:
        return [work(one) for one in every]
    with ThreadPoolExecutor(at_once) as pool:
        return list(pool.map(work, every))


def both(work: Callable[[], T], other: Callable[[], R]) -> tuple[T, R]:
    """What two pieces of work come to. The caller's own thread does the first; where both fail, its error is raised."""
    if len(os.sched_getaffinity(0)) < 2:
        return work(), other()
    with ThreadPoolExecutor(1) as pool:
        beside = pool.submit(other)
        return work(), beside.result()
