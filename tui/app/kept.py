"""Results that verbs left beside a dive, read again only where they were written anew."""

from collections.abc import Callable
from pathlib import Path
from typing import Any, Generic, TypeVar

from bridge.file_size import read_small
from bridge.plain import from_json

T = TypeVar("T")


class Kept(Generic[T]):
    """`typed` makes of a JSON value what a screen shows, None where it is no such thing."""

    def __init__(self, typed: Callable[[Any], T | None]) -> None:
        self._typed = typed
        self._of: tuple[Path, int] | None = None
        self._unkept: Any = None
        self._value: T | None = None

    def read(self, path: Path, unkept: Any = None) -> T | None:
        """What is in the file; None where there is none, or something else.

        `unkept` is a newer result that could not be written there: then that, and not what lies there.
        """
        of = path, written_ns(path)
        if of != self._of or unkept is not self._unkept:
            self._of, self._unkept = of, unkept
            self._value = self._typed(_json(path) if unkept is None else unkept)
        return self._value


def written_ns(path: Path) -> int:
    """When a file was last written; 0 where there is none."""
    try:
        return path.stat().st_mtime_ns
    except OSError:
        return 0


def newer(path: Path, than: Path) -> bool:
    """Whether a file is there and was written after another: by the run that wrote that, not by one before."""
    return written_ns(path) >= written_ns(than) > 0


def _json(path: Path) -> Any:
    try:
        return from_json(read_small(path))
    except (OSError, ValueError):
        return None
