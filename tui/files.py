"""Write the files of a verb independently; those that can't be written are named after all other output."""

import os
from collections.abc import Callable
from pathlib import Path
from types import TracebackType
from typing import Any, Self

from bridge.errors import LogError, ParamUnwritten
from tui import exit_codes, progress, show
from tui.whole_file import replace_file


class Files:
    """Within `with`, the files of a verb; at its end, each that could not be written is named on standard error.

    A failed file prevents neither the output nor another file. `written` lists the files written, in sentences.
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
            show.complain(sentence)

    def attempt(self, write: Callable[[], object], sentence: str = "") -> bool:
        """Run `write` and return whether it succeeded; if so, add `sentence` to `written`, unless it is empty."""
        try:
            write()
        except BrokenPipeError:  # the reader of standard output has closed it
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
        """`attempt` to write `text` to `path`, completely or not at all."""

        def write() -> None:
            try:
                replace_file(path, text)
            except OSError as error:
                raise LogError(f"{path}: can't be written ({error.strerror}); give another file") from None

        return self.attempt(write, sentence)

    def json(self, data: Any, target: str | None) -> bool:
        """As `show.write_json`; if that fails, a program that follows the progress gets the data itself."""

        def write() -> None:
            try:
                show.write_json(data, target)
            except LogError as error:
                if progress.asked(os.environ):
                    show.tell_program(
                        progress.Report(progress.UNKEPT, 1.0, str(error), result=show.plain(data))
                    )
                raise

        return self.attempt(write)

    def code(self, answered: int) -> int:
        """The exit code: BAD_INPUT if a file could not be written, otherwise that of the answer."""
        return exit_codes.BAD_INPUT if self._failed else answered
