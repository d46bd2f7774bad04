"""Runs a batch: known results from the cache, the other jobs, their results into the cache, so that it can go on."""

import json
import os
from collections.abc import Callable, Generator, Iterable, Sequence
from contextlib import closing
from dataclasses import dataclass, replace
from pathlib import Path

from bridge.errors import LogError
from bridge.files import ODD, size_to_read
from bridge.plain import from_json
from identify.batch.jobs import Job, Result


class Cache:
    """Results by key in an append-only file. When `add` returns, the operating system has the result.

    Raises LogError if the file can't be read or written.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
            self._file = os.open(path, os.O_RDWR | os.O_CREAT | os.O_APPEND, 0o644)
            if size_to_read(path) is None:
                raise OSError(*ODD, str(path))
            text = path.read_bytes()
            if text and not text.endswith(b"\n"):  # the last line was cut by the end of the last batch
                os.write(self._file, b"\n")
        except OSError as error:
            raise self._trouble(error) from None
        self._known = dict(filter(None, map(_entry, text.splitlines())))

    def __len__(self) -> int:
        return len(self._known)

    def get(self, key: str) -> Result | None:
        return self._known.get(key)

    def add(self, result: Result) -> None:
        """Keep a result that the same job would give again (`final`); other results are dropped."""
        if not result.final or result.key in self._known:
            return
        line = json.dumps(result.to_json(), allow_nan=False).encode() + b"\n"
        try:
            while line:
                line = line[os.write(self._file, line) :]
        except OSError as error:
            raise self._trouble(error) from None
        self._known[result.key] = result

    def close(self) -> None:
        os.close(self._file)

    def _trouble(self, error: OSError) -> LogError:
        return LogError(
            f"{self.path}: the results can't be kept there ({error.strerror}); give another folder with --out"
        )


def _entry(line: bytes) -> tuple[str, Result] | None:
    """Key and result of a line; None for a line that was cut short or is not a result of ours."""
    try:
        result = Result.from_json(from_json(line))
    except (ValueError, TypeError):
        return None
    return result.key, result


Engine = Callable[[Iterable[Job]], Generator[Result, None, None]]
"""Runs jobs and yields results as they arrive, in no order; closing the generator stops the work."""


@dataclass(frozen=True)
class Standing:
    """Progress of a batch: of `total` dives, `kept` came from the cache, `done` are new; `failed` of them have an
    error.
    """

    total: int
    kept: int
    done: int
    failed: int

    @property
    def share(self) -> float:
        return (self.kept + self.done) / self.total if self.total else 1.0

    def time_left_s(self, elapsed_s: float) -> float | None:
        """Remaining time at the pace so far; None before the first new result."""
        if not self.done:
            return None
        return elapsed_s / self.done * (self.total - self.kept - self.done)


def run_batch(
    jobs: Sequence[Job], cache: Cache, engine: Engine, progress: Callable[[Standing], None]
) -> list[Result]:
    """Results of all jobs, once per key. `told` is called with the progress at the start and after each new result.

    An exception from `engine` ends the batch; the results before it are in the cache.
    """
    results: dict[str, Result] = {}
    todo: dict[str, Job] = {}
    for job in jobs:
        kept = cache.get(job.key)
        if kept is None:
            todo[job.key] = job
        else:
            results[job.key] = replace(kept, dive=job.recording.name, source=str(job.recording.path))
    known = len(results)

    def tell() -> None:
        failed = sum(result.answer is None for result in results.values())
        progress(Standing(known + len(todo), known, len(results) - known, failed))

    tell()
    if todo:
        with closing(engine(todo.values())) as coming:
            for result in coming:
                cache.add(result)
                results[result.key] = result
                tell()
    return list(results.values())
