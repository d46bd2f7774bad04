"""Run jobs in parallel, each in its own process; they report their progress and end with the process that waits."""

import multiprocessing
import os
import queue
import threading
from collections.abc import Callable, Mapping
from concurrent.futures import Future, ProcessPoolExecutor
from typing import TypeVar

LISTEN_S = 0.2

Result = TypeVar("Result")
Progress = Callable[[float], None]
Job = Callable[[Progress], Result]

_shares: "multiprocessing.Queue[tuple[str, float]] | None" = None


def side_by_side(
    jobs: Mapping[str, Job[Result]],
    tell: Callable[[Mapping[str, float]], None],
    processes: int = 2,
) -> dict[str, Result]:
    """Return the result of each job, by name; a job must be picklable, like a `partial` of a module's function.

    `tell` gets the share done of every job, whenever a job has come further.
    """
    context = multiprocessing.get_context("spawn")
    shares: multiprocessing.Queue[tuple[str, float]] = context.Queue()
    done = dict.fromkeys(jobs, 0.0)
    with ProcessPoolExecutor(min(processes, len(jobs)), context, _join, (shares,)) as pool:
        running: dict[str, Future[Result]] = {
            name: pool.submit(_in_process, name, job) for name, job in jobs.items()
        }
        tell(done)
        while not all(future.done() for future in running.values()):
            try:
                name, share = shares.get(timeout=LISTEN_S)
            except queue.Empty:
                continue
            done[name] = share
            tell(done)
        return {name: future.result() for name, future in running.items()}


def _join(shares: "multiprocessing.Queue[tuple[str, float]]") -> None:
    global _shares
    _shares = shares
    threading.Thread(target=_leave_with_parent, daemon=True).start()


def _leave_with_parent() -> None:
    """End this process when its parent is gone: nobody waits for the job then."""
    parent = multiprocessing.parent_process()
    if parent is not None:
        parent.join()
        os._exit(1)


def _in_process(name: str, job: Job[Result]) -> Result:
    assert _shares is not None
    shares = _shares
    return job(lambda share: shares.put((name, share)))
