"""A command in a separate process, whose output lines are read without blocking."""

import contextlib
import os
import shutil
import signal
import subprocess
import sys
from collections.abc import Mapping, Sequence
from typing import Final

KILL_AFTER_S: Final = 5.0
READ_BYTES: Final = 65536


def seatrial_command() -> list[str]:
    """Arguments that start the `seatrial` command of this installation with this Python, from any working folder."""
    return [sys.executable, "-P", "-m", "tui"]


def as_wide() -> dict[str, str]:
    """Environment for a command whose lines are shown on this process's terminal: the terminal's width."""
    return {"COLUMNS": str(shutil.get_terminal_size().columns)}


class Job:
    """Runs the command `words` in a new process group; `title` is its name for the user.

    Call `lines` often; `code` is set once the command has ended and all its output was read. `cancel` asks the command
    to stop, as Ctrl-C does; if it has not stopped `KILL_AFTER_S` later, it is killed with all its workers.
    """

    def __init__(
        self, title: str, words: Sequence[str], environment: Mapping[str, str], now_s: float
    ) -> None:
        self.title, self.began_s = title, now_s
        self.code: int | None = None
        self._process = subprocess.Popen(
            list(words),
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            env={**os.environ, **environment},
            start_new_session=True,
        )
        assert self._process.stdout is not None
        self._out = self._process.stdout.fileno()
        os.set_blocking(self._out, False)
        self._rest, self._ended = b"", False
        self._kill_s: float | None = None
        self.cancelled = False

    def lines(self, now_s: float) -> list[str]:
        """Complete lines of output since the last call."""
        if self._kill_s is not None and now_s >= self._kill_s:
            self._signal(signal.SIGKILL)
        self._read()
        if self._ended and self.code is None:
            self.code = self._process.poll()
            if self.code is not None and self._process.stdout is not None:
                self._process.stdout.close()
        *whole, self._rest = self._rest.split(b"\n")
        if self._ended and self._rest:
            whole, self._rest = [*whole, self._rest], b""
        return [line.decode(errors="replace").rstrip() for line in whole]

    def cancel(self, now_s: float) -> None:
        """Ask the command to stop; kills it with a later call of `lines` if it does not."""
        self.cancelled = True
        self._kill_s = now_s + KILL_AFTER_S
        self._signal(signal.SIGINT)

    def kill(self) -> None:
        """Kill the command at once, and wait until it has ended."""
        if self.code is None:
            self._signal(signal.SIGKILL)
            self.code = self._process.wait()
            if self._process.stdout is not None:
                self._process.stdout.close()

    def _read(self) -> None:
        while not self._ended:
            try:
                data = os.read(self._out, READ_BYTES)
            except BlockingIOError:
                # Workers that outlive the command hold the pipe open: the command's own end counts.
                self._ended = self._process.poll() is not None
                return
            self._ended = not data
            self._rest += data

    def _signal(self, number: signal.Signals) -> None:
        if self._process.poll() is None:
            with contextlib.suppress(ProcessLookupError):
                os.killpg(self._process.pid, number)
