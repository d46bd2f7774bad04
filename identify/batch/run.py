"""Runs a batch: takes known results from the cache, runs the other jobs, and caches their results as they arrive."""

from collections.abc import Callable, Generator, Iterable, Sequence
from contextlib import closing
from dataclasses import dataclass, replace

from identify.batch.cache import Cache
from identify.batch.jobs import Job, Result

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
    jobs: Sequence[Job], cache: Cache, engine: Engine, told: Callable[[Standing], None]
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
        told(Standing(known + len(todo), known, len(results) - known, failed))

    tell()
    if todo:
        with closing(engine(todo.values())) as coming:
            for result in coming:
                cache.add(result)
                results[result.key] = result
                tell()
    return list(results.values())
