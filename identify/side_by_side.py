"""Runs work on several items at once, on all processors; the numerical kernels hold no lock while they run.

The caller works too, and idle threads help it. So there is no more work at once than processors, however deep the
calls are nested, and no call waits for a thread.
"""

import os
from collections.abc import Callable, Iterable
from concurrent.futures import ThreadPoolExecutor
from functools import cache
from typing import TypeVar

T = TypeVar("T")
R = TypeVar("R")


@cache
def _helpers() -> ThreadPoolExecutor:
    """Threads for all processors but the caller's."""
    return ThreadPoolExecutor(max((os.cpu_count() or 1) - 1, 1), "helper")


# A process that forks leaves the threads behind.
os.register_at_fork(after_in_child=_helpers.cache_clear)


def side_by_side(
    work: Callable[[T], R], things: Iterable[T], size: Callable[[T], float] | None = None
) -> list[R]:
    """Return `work` of each item, in order; raise the error of the first item that failed.

    The largest items by `size` begin first, so that no processor waits long for the last. After a failure nothing
    more begins.
    """
    every = list(things)
    at_once = min(len(os.sched_getaffinity(0)), len(every))
    if at_once < 2:
        return [work(item) for item in every]
    order = iter(
        range(len(every)) if size is None else sorted(range(len(every)), key=lambda k: -size(every[k]))
    )
    results: dict[int, R] = {}
    failures: dict[int, BaseException] = {}

    def share() -> None:
        for k in order:
            if failures:
                return
            try:
                results[k] = work(every[k])
            except BaseException as error:  # noqa: BLE001 (raised by the caller when all have ended)
                failures[k] = error

    helping = [_helpers().submit(share) for _ in range(at_once - 1)]
    share()
    for helper in helping:
        if not helper.cancel():
            helper.result()
    if failures:
        raise failures[min(failures)]
    return [results[k] for k in range(len(every))]


def both(work: Callable[[], T], other: Callable[[], R]) -> tuple[T, R]:
    """Return the results of two pieces of work; if both fail, the error of the first is raised."""
    first: list[T] = []
    second: list[R] = []
    works = (lambda: first.append(work()), lambda: second.append(other()))
    side_by_side(lambda k: works[k](), range(2))
    return first[0], second[0]
