"""Work in threads of one process, on all processors; numerical kernels hold no lock while they run.

The caller works too, and idle threads help it, one for each further processor. So work does not multiply however deep
the calls are nested. A caller that has nothing left to do, and waits for a helper's last item, helps with the calls
that this item makes (leapfrogging, Wagner and Calder 1993): no other work, which might wait for the caller. A `Shared`
result is computed by its first caller and kept only while somebody holds it.
"""

import os
from collections import defaultdict, deque
from collections.abc import Callable, Iterable
from concurrent.futures import ThreadPoolExecutor
from contextvars import copy_context
from functools import cache
from threading import Condition, Lock, get_ident
from typing import Any, Generic, TypeVar
from weakref import WeakValueDictionary

T = TypeVar("T")
R = TypeVar("R")


class _Call:
    """A call in progress. share: works on its items until none is left to begin. helpers: threads that work on it, with
    the number of calls that each had in progress before."""

    def __init__(self, share: Callable[[], None]) -> None:
        self.share: Callable[[], None] | None = share
        self.helpers: dict[int, int] = {}


class _Team:
    """Threads for all processors but the caller's, and the calls in progress of every thread, outermost first."""

    def __init__(self) -> None:
        self._pool = ThreadPoolExecutor(max(len(os.sched_getaffinity(0)) - 1, 1), "helper")
        self._changed = Condition()
        self._calls: defaultdict[int, list[_Call]] = defaultdict(list)

    def work(self, share: Callable[[], None], helpers: int) -> None:
        """Work on a call's items with at most so many helpers, until all have ended."""
        call, mine = _Call(share), self._calls[get_ident()]
        with self._changed:
            mine.append(call)
            self._changed.notify_all()
        # Each in the caller's context: NumPy's `errstate` is part of it.
        asked = [self._pool.submit(copy_context().run, self._help, call) for _ in range(helpers)]
        try:
            share()
        finally:
            with self._changed:
                # A helper that comes too late finds nothing: it must not keep the items and results of this call.
                call.share = None
                mine.remove(call)
            for each in asked:
                each.cancel()
            while (within := self._next_within(call)) is not None:
                self._help(within)

    def _help(self, call: _Call) -> None:
        me = get_ident()
        with self._changed:
            if (share := call.share) is None:
                return
            call.helpers[me] = len(self._calls[me])
        try:
            share()
        finally:
            with self._changed:
                call.share = None
                del call.helpers[me]
                self._changed.notify_all()

    def _next_within(self, call: _Call) -> _Call | None:
        """A call that a helper makes for an item of `call`, as soon as there is one; None once all helpers have
        ended."""
        with self._changed:
            while call.helpers:
                for thread, before in call.helpers.items():
                    for within in self._calls[thread][before:]:
                        if within.share is not None:
                            return within
                self._changed.wait()
        return None


@cache
def _team() -> _Team:
    return _Team()


# A process that forks leaves the threads behind.
if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_team.cache_clear)


def side_by_side(
    work: Callable[[T], R], things: Iterable[T], size: Callable[[T], float] | None = None
) -> list[R]:
    """Return `work` of each item, in order; raise the error of the first item that failed, or an interrupt before it.

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

    try:
        _team().work(share, at_once - 1)
    finally:
        deque(order, maxlen=0)
    if failures:
        raise failures[min(failures, key=lambda k: (isinstance(failures[k], Exception), k))]
    return [results[k] for k in range(len(every))]


def both(work: Callable[[], T], other: Callable[[], R]) -> tuple[T, R]:
    """Return the results of two pieces of work; if both fail, the error of the first is raised."""
    first: list[T] = []
    second: list[R] = []
    works = (lambda: first.append(work()), lambda: second.append(other()))
    side_by_side(lambda k: works[k](), range(2))
    return first[0], second[0]


class Shared(Generic[T]):
    """A result that others may ask for too, for as long as any of them holds this object; and its arguments."""

    def __init__(self, work: Callable[..., T], arguments: tuple[Any, ...]) -> None:
        self._work, self._arguments, self._lock = work, arguments, Lock()
        self._value: T | None = None

    @property
    def value(self) -> T:
        """The result; raises any error of the work."""
        with self._lock:
            if self._value is None:
                self._value = self._work(*self._arguments)
            return self._value


def shared(work: Callable[..., T]) -> Callable[..., Shared[T]]:
    """Return a function that gives the shared result of `work` for its arguments, computed when `value` is first
    read.

    Strings and tuples are the same argument if they are equal, others only if they are the same object, which the
    result keeps alive.
    """
    guard = Lock()
    held: WeakValueDictionary[tuple[object, ...], Shared[T]] = WeakValueDictionary()

    def of(*arguments: Any) -> Shared[T]:
        key = tuple(argument if isinstance(argument, str | tuple) else id(argument) for argument in arguments)
        with guard:
            result = held.get(key)
            if result is None:
                result = held[key] = Shared(work, arguments)
            return result

    return of
