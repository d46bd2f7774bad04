"""Runs a batch on this computer's cores: a process per core, one job at a time. A process that dies loses only its
job.
"""

import multiprocessing
import os
import signal
from collections.abc import Generator, Iterable, Iterator
from contextlib import contextmanager
from multiprocessing import resource_tracker
from multiprocessing.connection import Connection, wait
from multiprocessing.context import SpawnProcess

from identify.batch.jobs import Job, Result, one_thread, run_job

_CONTEXT = multiprocessing.get_context(
    "spawn"
)  # a fork would inherit the threads of torch and numba in a broken state


def cores() -> int:
    """Number of cores that this process may use."""
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
