"""Work in processes of its own: a program whose output is read without blocking, and functions run side by side."""

import contextlib
import multiprocessing
import os
import queue
import signal
import subprocess
import sys
import threading
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import Future, ProcessPoolExecutor
from typing import Final, TypeVar

KILL_AFTER_S: Final = 5.0
READ_BYTES: Final = 65536


class Job:
    """Runs this Python with `words`, such as `-m MODULE`, in a new process group; `title` is its name for the user.

    Call `lines` often; `code` is set once the program has ended and all its output was read: that to standard error
    alone if `errors_alone`. `cancel` asks it to stop, as Ctrl-C does; if it has not stopped `KILL_AFTER_S` later, it is
    killed with all its workers.
    """

    def __init__(
        self,
        title: str,
        words: Sequence[str],
        now_s: float,
        environment: Mapping[str, str] | None = None,
        *,
        errors_alone: bool = False,
    ) -> None:
        self.title, self.began_s = title, now_s
        self.code: int | None = None
        self._process = subprocess.Popen(
            # -P: the working folder may hold a module of the same name.
            [sys.executable, "-P", *words],
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL if errors_alone else subprocess.PIPE,
            stderr=subprocess.PIPE if errors_alone else subprocess.STDOUT,
            env={**os.environ, **(environment or {})},
            start_new_session=True,
        )
        stream = self._process.stderr if errors_alone else self._process.stdout
        assert stream is not None
        self._stream, self._out = stream, stream.fileno()
        os.set_blocking(self._out, False)
        self._partial, self._ended = b"", False
        self._kill_s: float | None = None
        self.cancelled = False

    def lines(self, now_s: float) -> list[str]:
        """Complete lines of output since the last call."""
        if self._kill_s is not None and now_s >= self._kill_s:
            self._signal(signal.SIGKILL)
        self._read()
        if self._ended and self.code is None:
            self.code = self._process.poll()
            if self.code is not None:
                self._stream.close()
        *whole, self._partial = self._partial.split(b"\n")
        if self._ended and self._partial:
            whole, self._partial = [*whole, self._partial], b""
        return [line.decode(errors="replace").rstrip() for line in whole]

    def cancel(self, now_s: float) -> None:
        """Ask the command to stop; kills it with a later call of `lines` if it does not."""
        self.cancelled = True
        self._kill_s = now_s + KILL_AFTER_S
        self._signal(signal.SIGINT)

    def interrupt(self) -> None:
        """Press Ctrl-C, for a command that takes it as a key."""
        self._signal(signal.SIGINT)

    def kill(self) -> None:
        """Kill the command at once, and wait until it has ended."""
        if self.code is None:
            self._signal(signal.SIGKILL)
            self.code = self._process.wait()
            self._stream.close()

    def _read(self) -> None:
        # Workers that outlive the command hold the pipe open: the command's own end counts. What it said last is in the
        # pipe by then, and read below.
        is_over = self._process.poll() is not None
        while not self._ended:
            try:
                data = os.read(self._out, READ_BYTES)
            except BlockingIOError:
                self._ended = is_over
                return
            self._ended = not data
            self._partial += data

    def _signal(self, number: signal.Signals) -> None:
        if self._process.poll() is None:
            with contextlib.suppress(ProcessLookupError):
                os.killpg(self._process.pid, number)


LISTEN_S = 0.2

Result = TypeVar("Result")
Progress = Callable[[float], None]

_shares: "multiprocessing.Queue[tuple[str, float]] | None" = None


def side_by_side(
    jobs: Mapping[str, Callable[[Progress], Result]],
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
    # Once all results are there nobody reads the shares any more, and a process must not wait for that at its end.
    shares.cancel_join_thread()
    threading.Thread(target=end_with_parent, daemon=True).start()


def end_with_parent() -> None:
    """End this process when its parent is gone: nobody waits for its results then."""
    parent = multiprocessing.parent_process()
    if parent is not None:
        parent.join()
        os._exit(1)


def _in_process(name: str, job: Callable[[Progress], Result]) -> Result:
    assert _shares is not None
    shares = _shares
    return job(lambda share: shares.put((name, share)))
