"""Computes once a result that several methods need when they run in parallel on one dive: the first caller computes
it, the others wait.

The result is kept only while somebody holds it, so a method that runs alone computes everything itself.
"""

from collections.abc import Callable
from threading import Lock
from typing import Any, Generic, TypeVar
from weakref import WeakValueDictionary

T = TypeVar("T")


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
