"""The work on this computer's cores: a process each, one job at a time, and one that dies costs its own job alone."""

import multiprocessing
import os
import signal
from collections.abc import Generator, Iterable, Iterator
from contextlib import contextmanager
from multiprocessing import resource_tracker
from multiprocessing.connection import Connection, wait
from multiprocessing.context import SpawnProcess

from identify.batch.jobs import Job, Result, run_job
from identify.batch.threads import one_thread

_CONTEXT = multiprocessing.get_context(
    "spawn"
)  # a fork would inherit the threads of torch and numba half alive


def cores() -> int:
    """How many cores this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def run_here(jobs: Iterable[Job], processes: int) -> Generator[Result, None, None]:
    """The result of each job as it comes, in no order. Closing it, or Ctrl-C, ends the processes at once.

    No more jobs are taken from `jobs` than there are processes, and no result is kept here.
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
    """A process and this end of the pipe to it."""

    def __init__(self) -> None:
        self.pipe, far = _CONTEXT.Pipe()
        self._process: SpawnProcess = _CONTEXT.Process(target=_serve, args=(far,), daemon=True)
        with _interrupts_blocked():
            self._process.start()
        far.close()

    def begin(self, job: Job) -> None:
        """Hand over a job; of a process that is dead already, `result` tells."""
        try:
            self.pipe.send(job)
        except BrokenPipeError:
            self._process.join()

    def result(self) -> Result | None:
        """The result of the job, once the pipe is ready; None where the process died of it."""
        try:
            result = self.pipe.recv()
        except (EOFError, ConnectionResetError):
            return None
        assert isinstance(result, Result)
        return result

    def died(self) -> str:
        """How the process ended, in a sentence; it is over after this."""
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
    """What a process does: job after job until nobody listens any more."""
    one_thread()
    while True:
        try:
            job = pipe.recv()
        except EOFError:
            return
        pipe.send(run_job(job))


@contextmanager
def _interrupts_blocked() -> Iterator[None]:
    """A process started within never hears Ctrl-C: the one that started it does, and ends it."""
    resource_tracker.ensure_running()  # its own start, beside the first process, would lift the mask again
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)
