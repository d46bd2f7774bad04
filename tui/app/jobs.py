"""The app's running verbs, each in a process of its own. They belong to the app, not to a screen.

A screen starts a job, may be left and opened again, and reads its progress from `state`.
"""

import asyncio
import time
from collections.abc import Awaitable, Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

from bridge.errors import ConfigError
from tui import exit_codes, job
from tui.job import Done
from tui.progress import PAGE, UNKEPT, Report

Work = Callable[[Sequence[str], Callable[[Report], None]], Awaitable[Done]]


@dataclass(frozen=True)
class JobState:
    """A running or finished verb. `words` is its command line; `told` holds its progress reports, the oldest first.

    `done` is None while it runs. `cancelled` is set as soon as it is ordered to end; times are by the jobs' clock.
    """

    words: tuple[str, ...]
    began_s: float
    told: tuple[Report, ...] = ()
    done: Done | None = None
    ended_s: float | None = None
    cancelled: bool = False

    @property
    def runs(self) -> bool:
        return self.done is None

    @property
    def draws(self) -> bool:
        """Whether it has reached its page: all other results are written by then."""
        return any(report.of == PAGE for report in self.told)

    @property
    def unkept(self) -> Any:
        """Its result if that could not be written to its file; None if it was written or does not exist yet."""
        return next((report.result for report in self.told if report.of == UNKEPT), None)

    @property
    def answered(self) -> bool:
        """Whether it has ended, or only has its page left to draw."""
        return not self.runs or self.draws


class Jobs:
    """At most one job per verb. `work` runs one job to its end, as `tui.job.work` does."""

    def __init__(self, work: Work = job.work, clock: Callable[[], float] = time.monotonic) -> None:
        self._work, self._clock = work, clock
        self._states: dict[str, JobState] = {}
        self._tasks: dict[str, asyncio.Task[Done]] = {}

    def now_s(self) -> float:
        """Current time on the clock of `began_s` and `ended_s`."""
        return self._clock()

    def state(self, verb: str) -> JobState | None:
        """State of the verb's running or last job; None if there was none."""
        return self._states.get(verb)

    def unkept(self, verb: str, dive: object) -> Any:
        """Result of the verb's last run on a dive, if it could not be written next to the dive; otherwise None."""
        state = self.state(verb)
        return state.unkept if state is not None and state.words[1] == str(dive) else None

    def runs(self, verb: str) -> bool:
        state = self._states.get(verb)
        return state is not None and state.runs

    def start(self, verb: str, words: Sequence[str]) -> None:
        """Run the command line `words` (`identify DIVE ...`) as the job of `verb`, within the app's event loop.

        Raises ConfigError if one runs already.
        """
        if self.runs(verb):
            raise ConfigError(f"{verb} runs already; wait for it, or cancel it")
        self._states[verb] = JobState(tuple(words), self._clock())
        task = asyncio.create_task(self._work_of(verb, tuple(words)), name=verb)
        task.add_done_callback(lambda ended: self._end(verb, ended))
        self._tasks[verb] = task

    def cancel(self, verb: str) -> bool:
        """End the job and all processes that it started; False if none runs. It is over once its state has a `done`."""
        if not self.runs(verb):
            return False
        self._change(verb, cancelled=True)
        self._tasks[verb].cancel()
        return True

    async def _work_of(self, verb: str, words: tuple[str, ...]) -> Done:
        def hear(told: Report) -> None:
            self._change(verb, told=(*self._states[verb].told, told))

        try:
            return await self._work(words, hear)
        except OSError as error:
            return Done(exit_codes.BAD_INPUT, None, (f"{verb} could not be started ({error.strerror})",))

    def _end(self, verb: str, task: asyncio.Task[Done]) -> None:
        """Store how the job ended; also called for a task that was cancelled before it began."""
        cancelled = task.cancelled()
        done = Done(exit_codes.INTERRUPTED, None, ()) if cancelled else task.result()
        stopped = cancelled or self._states[verb].cancelled
        self._change(verb, done=done, ended_s=self._clock(), cancelled=stopped)

    def _change(self, verb: str, **new: object) -> None:
        self._states[verb] = replace(self._states[verb], **new)  # type: ignore[arg-type]
