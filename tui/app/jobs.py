"""The verbs that the app has at work, each in a process of its own. They belong to the app, not to a screen.

A screen starts one, may be left and opened again, and reads from `state` how far it is.
"""

import asyncio
import time
from collections.abc import Awaitable, Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

from bridge.errors import ConfigError
from tui import exit_codes, job
from tui.job import Done
from tui.told import PAGE, UNKEPT, Told

Work = Callable[[Sequence[str], Callable[[Told], None]], Awaitable[Done]]


@dataclass(frozen=True)
class JobState:
    """A verb at work, or as it ended. `words` is its command line; `told` all that it has told, the oldest first.

    `done` is None while it runs. `cancelled` from the moment that it was told to end; times by the jobs' clock.
    """

    words: tuple[str, ...]
    began_s: float
    told: tuple[Told, ...] = ()
    done: Done | None = None
    ended_s: float | None = None
    cancelled: bool = False

    @property
    def runs(self) -> bool:
        return self.done is None

    @property
    def draws(self) -> bool:
        """Whether it came as far as its page: all else that it leaves is there."""
        return any(one.of == PAGE for one in self.told)

    @property
    def unkept(self) -> Any:
        """Its result where that could not be written to its place; None where it could, and while there is none."""
        return next((one.result for one in self.told if one.of == UNKEPT), None)

    @property
    def answered(self) -> bool:
        """Whether it has ended, or has only its page to draw."""
        return not self.runs or self.draws


class Jobs:
    """At most one job of each verb. `work` runs one to its end, as `tui.job.work` does."""

    def __init__(self, work: Work = job.work, clock: Callable[[], float] = time.monotonic) -> None:
        self._work, self._clock = work, clock
        self._states: dict[str, JobState] = {}
        self._tasks: dict[str, asyncio.Task[Done]] = {}

    def now_s(self) -> float:
        """The time that `began_s` and `ended_s` are counted by."""
        return self._clock()

    def state(self, verb: str) -> JobState | None:
        """The job of that verb that runs or was the last to; None where there was none."""
        return self._states.get(verb)

    def unkept(self, verb: str, dive: object) -> Any:
        """The result of the last run of that verb on a dive, where it could not be kept beside it; else None."""
        state = self.state(verb)
        return state.unkept if state is not None and state.words[1] == str(dive) else None

    def runs(self, verb: str) -> bool:
        state = self._states.get(verb)
        return state is not None and state.runs

    def start(self, verb: str, words: Sequence[str]) -> None:
        """Run the command line `words` (`identify DIVE ...`) as the job of `verb`; within the app's own loop.

        Raises ConfigError where one runs already.
        """
        if self.runs(verb):
            raise ConfigError(f"{verb} runs already; wait for it, or cancel it")
        self._states[verb] = JobState(tuple(words), self._clock())
        task = asyncio.create_task(self._work_of(verb, tuple(words)), name=verb)
        task.add_done_callback(lambda ended: self._end(verb, ended))
        self._tasks[verb] = task

    def cancel(self, verb: str) -> bool:
        """End it, and all that it started; False where nothing runs. It is over once its state has a `done`."""
        if not self.runs(verb):
            return False
        self._change(verb, cancelled=True)
        self._tasks[verb].cancel()
        return True

    async def _work_of(self, verb: str, words: tuple[str, ...]) -> Done:
        def hear(told: Told) -> None:
            self._change(verb, told=(*self._states[verb].told, told))

        try:
            return await self._work(words, hear)
        except OSError as error:
            return Done(exit_codes.BAD_INPUT, None, (f"{verb} could not be started ({error.strerror})",))

    def _end(self, verb: str, task: asyncio.Task[Done]) -> None:
        """Keep how it ended; called for a task that was cancelled before it began as well."""
        cancelled = task.cancelled()
        done = Done(exit_codes.INTERRUPTED, None, ()) if cancelled else task.result()
        stopped = cancelled or self._states[verb].cancelled
        self._change(verb, done=done, ended_s=self._clock(), cancelled=stopped)

    def _change(self, verb: str, **new: object) -> None:
        self._states[verb] = replace(self._states[verb], **new)  # type: ignore[arg-type]
