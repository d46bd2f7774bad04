"""Runs work on several items at once, on all processors; the numerical kernels hold no lock while they run."""

import os
from collections.abc import Callable, Iterable
from concurrent.futures import ThreadPoolExecutor
from typing import TypeVar

T = TypeVar("T")
R = TypeVar("R")


def side_by_side(
    work: Callable[[T], R], things: Iterable[T], size: Callable[[T], float] | None = None
) -> list[R]:
    """Return `work` of each item, in order; raise the error of the first item that failed.

    The largest items by `size` begin first, so that no processor waits long for the last. The threads end with the
    call: a process that forks later must not inherit a pool whose threads it lacks.
    """
    every = list(things)
    at_once = min(len(os.sched_getaffinity(0)), len(every))
    if at_once < 2:
        return [work(item) for item in every]
    order = range(len(every)) if size is None else sorted(range(len(every)), key=lambda k: -size(every[k]))
    with ThreadPoolExecutor(at_once) as pool:
        begun = {k: pool.submit(work, every[k]) for k in order}
        try:
            return [begun[k].result() for k in range(len(every))]
        except BaseException:
            pool.shutdown(wait=False, cancel_futures=True)
            raise


def both(work: Callable[[], T], other: Callable[[], R]) -> tuple[T, R]:
    """Return the results of two pieces of work. The caller's own thread runs the first; if both fail, its error is
    raised."""
    if len(os.sched_getaffinity(0)) < 2:
        return work(), other()
    with ThreadPoolExecutor(1) as pool:
        second = pool.submit(other)
        return work(), second.result()
