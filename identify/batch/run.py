"""Runs a batch: known results from the cache, the other jobs on this computer's cores or by another engine.

The cache takes each result as it arrives, so that a batch that was stopped can go on. On this computer a process per
core does one job at a time; a process that dies loses only its job.
"""

import json
import multiprocessing
import os
import signal
from collections.abc import Callable, Generator, Iterable, Iterator, Sequence
from contextlib import closing, contextmanager
from dataclasses import dataclass, replace
from multiprocessing import resource_tracker
from multiprocessing.connection import Connection, wait
from multiprocessing.context import SpawnProcess
from pathlib import Path

from bridge.errors import LogError
from bridge.files import ODD, size_to_read
from bridge.plain import from_json
from identify.batch.jobs import Job, Result, one_thread, run_job


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
    """Results of all jobs, once per key. `progress` is called at the start and after each new result.

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


# A fork would inherit the threads of torch and numba in a broken state.
_CONTEXT = multiprocessing.get_context("spawn")


def cores() -> int:
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def run_here(jobs: Iterable[Job], processes: int) -> Generator[Result, None, None]:
    """Yield the result of each job as it arrives, in no order.

    Closing the generator, or Ctrl-C, ends the processes at once. Takes at most as many jobs from `jobs` as there are
    free processes, and keeps no result.
    """
    waiting = iter(jobs)
    idle: list[_Worker] = []
    busy: dict[Connection, tuple[_Worker, Job]] = {}
    try:
        while True:
            while len(busy) < processes and (job := next(waiting, None)) is not None:
                worker = idle.pop() if idle else _Worker()
                busy[worker.pipe] = (worker, job)
                worker.begin(job)
            if not busy:
                return
            for pipe in wait(list(busy)):
                assert isinstance(pipe, Connection)
                worker, job = busy.pop(pipe)
                result = worker.result()
                if result is None:
                    yield job.failed(worker.died(), final=False)
                else:
                    idle.append(worker)
                    yield result
    finally:
        for worker in [*idle, *(worker for worker, _ in busy.values())]:
            worker.end()


class _Worker:
    """A worker process and this end of its pipe."""

    def __init__(self) -> None:
        self.pipe, far = _CONTEXT.Pipe()
        self._process: SpawnProcess = _CONTEXT.Process(target=_serve, args=(far,), daemon=True)
        with _interrupts_blocked():
            self._process.start()
        far.close()

    def begin(self, job: Job) -> None:
        """Send a job. If the process is already dead, `result` returns None later."""
        try:
            self.pipe.send(job)
        except BrokenPipeError:
            self._process.join()

    def result(self) -> Result | None:
        """Result of the job, once the pipe is ready; None if the process died."""
        try:
            result = self.pipe.recv()
        except (EOFError, ConnectionResetError):
            return None
        assert isinstance(result, Result)
        return result

    def died(self) -> str:
        """Wait for the end of a dead process, close its pipe and say in a sentence how it ended."""
        self._process.join()
        code = self._process.exitcode or 0
        self.pipe.close()
        if code == -signal.SIGKILL:
            return "its process was killed, perhaps for want of memory; run again with fewer --processes"
        return f"its process ended by itself (exit code {code}); run again, and report it if it does so again"

    def end(self) -> None:
        self._process.terminate()
        self._process.join()
        self.pipe.close()


def _serve(pipe: Connection) -> None:
    """Main loop of a worker process: run job after job until the other end of the pipe closes."""
    one_thread()
    while True:
        try:
            job = pipe.recv()
        except EOFError:
            return
        pipe.send(run_job(job))


@contextmanager
def _interrupts_blocked() -> Iterator[None]:
    """Block SIGINT, so that a process started within ignores Ctrl-C; its parent receives Ctrl-C and ends it."""
    resource_tracker.ensure_running()  # started with the first process, the tracker would lift the mask again
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)
