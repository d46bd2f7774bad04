"""Several pieces of work at the same time in threads of one process: numerical kernels leave Python free meanwhile."""

from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from typing import TypeVar

T = TypeVar("T")


def together(works: Sequence[Callable[[], T]]) -> tuple[T, ...]:
    """What each of `works` (at least one) returns, in their order; raises what one of them raised.

    The last runs in the calling thread, where an interrupt reaches it: let it be the longest.
    """
    with ThreadPoolExecutor(max_workers=len(works)) as pool:
        beside = [pool.submit(work) for work in works[:-1]]
        last = works[-1]()
        return (*(one.result() for one in beside), last)
