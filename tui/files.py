"""The files that a verb leaves: each is tried for itself, and what can't be written is named after all else is said."""

import os
import sys
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from types import TracebackType
from typing import Any, Self

from bridge.errors import LogError, ParamUnwritten
from tui import exit_codes, progress, show
from tui.whole_file import replace_file


class Files:
    """Within `with`, the files of one verb; at its end each that could not be written is named on standard error.

    No file keeps the answer from being shown, nor another file from being written. `written` is what was, in sentences.
    """

    def __init__(self) -> None:
        self.written: list[str] = []
        self._failed: list[str] = []

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, _type: type[BaseException] | None, _error: object, _trace: TracebackType | None
    ) -> None:
        for sentence in self._failed:
            show.say(show.words(), f"seatrial: {' '.join(sentence.split())}")

    def attempt(self, write: Callable[[], object], sentence: str = "") -> bool:
        """Whether `write` could; then `sentence` is among those that were written, unless it is empty."""
        try:
            write()
        except BrokenPipeError:  # whoever reads standard output has left
            raise
        except (LogError, ParamUnwritten) as error:
            self._failed.append(str(error))
            return False
        except OSError as error:
            place = f"{error.filename}: " if error.filename else ""
            self._failed.append(f"{place}can't be written ({error.strerror}); give another place")
            return False
        if sentence:
            self.written.append(sentence)
        return True

    def text(self, path: Path, text: str, sentence: str = "") -> bool:
        """`attempt` to put `text` where `path` is, whole or not at all."""

        def write() -> None:
            try:
                replace_file(path, text)
            except OSError as error:
                raise LogError(f"{path}: can't be written ({error.strerror}); give another file") from None

        return self.attempt(write, sentence)

    def json(self, data: Any, target: str | None) -> bool:
        """As `show.write_json`; where that can't be, a program that reads along is told the data itself."""

        def write() -> None:
            try:
                show.write_json(data, target)
            except LogError as error:
                if progress.asked(os.environ):
                    _tell(progress.Report(progress.UNKEPT, 1.0, str(error), result=show.plain(data)))
                raise

        return self.attempt(write)

    def code(self, answered: int) -> int:
        """The exit code: that of a place that can't be written where one could not, else that of the answer."""
        return exit_codes.BAD_INPUT if self._failed else answered


def _tell(report: progress.Report) -> None:
    with suppress(BrokenPipeError):
        sys.stderr.write(progress.line(report))
        sys.stderr.flush()
