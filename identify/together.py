"""Runs several pieces of work at once in threads of one process; numerical kernels release Python's lock meanwhile."""

from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from typing import TypeVar

T = TypeVar("T")


def together(works: Sequence[Callable[[], T]]) -> tuple[T, ...]:
    """Return the results of `works` (at least one), in order; raise an error that any of them raised.

    The last runs in the calling thread, which receives an interrupt: put the longest last.
    """
    with ThreadPoolExecutor(max_workers=len(works)) as pool:
        started = [pool.submit(work) for work in works[:-1]]
        last = works[-1]()
        return (*(future.result() for future in started), last)
