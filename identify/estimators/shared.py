"""What methods beside each other on one dive both need, worked out once: whoever asks first works, the others wait.

It is kept while anybody holds it and no longer, so that a method alone works all of it out for itself.
"""

from collections.abc import Callable
from threading import Lock
from typing import Any, Generic, TypeVar
from weakref import WeakValueDictionary

T = TypeVar("T")


class Shared(Generic[T]):
    """A result that others may ask for too, for as long as one of them holds this; and what it was made of."""

    def __init__(self, work: Callable[..., T], arguments: tuple[Any, ...]) -> None:
        self._work, self._arguments, self._lock = work, arguments, Lock()
        self._value: T | None = None

    @property
    def value(self) -> T:
        """The result; raises what the work raised."""
        with self._lock:
            if self._value is None:
                self._value = self._work(*self._arguments)
            return self._value


def shared(work: Callable[..., T]) -> Callable[..., Shared[T]]:
    """`work` by its arguments, done at the first look at its `value`.

    Text and tuples are the same where they are equal, all else where it is the same object, which the result keeps
    alive.
    """
    guard = Lock()
    held: WeakValueDictionary[tuple[object, ...], Shared[T]] = WeakValueDictionary()

    def of(*arguments: Any) -> Shared[T]:
        key = tuple(one if isinstance(one, str | tuple) else id(one) for one in arguments)
        with guard:
            found = held.get(key)
            if found is None:
                found = held[key] = Shared(work, arguments)
            return found

    return of
