"""Results that verbs left next to a dive, read again only after the file has changed."""

from collections.abc import Callable
from pathlib import Path
from typing import Any, Generic, TypeVar

from bridge.file_size import read_small
from bridge.plain import from_json

T = TypeVar("T")


class Kept(Generic[T]):
    """`typed` converts a JSON value to the type that a screen shows, or returns None if it does not fit."""

    def __init__(self, typed: Callable[[Any], T | None]) -> None:
        self._typed = typed
        self._of: tuple[Path, int] | None = None
        self._unkept: Any = None
        self._value: T | None = None

    def read(self, path: Path, unkept: Any = None) -> T | None:
        """The content of the file; None if the file is missing or has other content.

        `unkept` is a newer result that could not be written there: it replaces the file's content.
        """
        stamp = path, written_ns(path)
        if stamp != self._of or unkept is not self._unkept:
            self._of, self._unkept = stamp, unkept
            self._value = self._typed(_json(path) if unkept is None else unkept)
        return self._value


def written_ns(path: Path) -> int:
    """Time of a file's last write, ns; 0 if the file is missing."""
    try:
        return path.stat().st_mtime_ns
    except OSError:
        return 0


def newer(path: Path, than: Path) -> bool:
    """Whether a file exists and is no older than `than`: then both come from the same run."""
    return written_ns(path) >= written_ns(than) > 0


def _json(path: Path) -> Any:
    try:
        return from_json(read_small(path))
    except (OSError, ValueError):
        return None
