"""A batch: what is known already is taken from where it is kept, the rest is done, and kept as it comes."""

from collections.abc import Callable, Generator, Iterable, Sequence
from contextlib import closing
from dataclasses import dataclass, replace

from identify.batch.cache import Cache
from identify.batch.jobs import Job, Result

Engine = Callable[[Iterable[Job]], Generator[Result, None, None]]
"""Results as they come, in no order; closing it stops the work."""


@dataclass(frozen=True)
class Standing:
    """How far a batch is: of `total` dives `kept` were known before and `done` are new; `failed` have an error."""

    total: int
    kept: int
    done: int
    failed: int

    @property
    def share(self) -> float:
        return (self.kept + self.done) / self.total if self.total else 1.0

    def time_left_s(self, elapsed_s: float) -> float | None:
        """How long the rest takes at the pace so far; None before the first result."""
        if not self.done:
            return None
        return elapsed_s / self.done * (self.total - self.kept - self.done)


def run_batch(
    jobs: Sequence[Job], cache: Cache, engine: Engine, told: Callable[[Standing], None]
) -> list[Result]:
    """The result of every job, each key once. `told` hears how it stands at first and after each result.

    Whatever `engine` raises ends the batch; what came before is in the cache.
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
