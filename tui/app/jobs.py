"""The app's running verbs, each in a process of its own, as lines, and their results next to a dive.

A job is the verb itself; if the app is gone, it goes on to its end: an upload is not cut short because a terminal was
closed. Jobs belong to the app, not to a screen: a screen starts one, may be left
and opened again, and reads its progress.
"""

import asyncio
import math
import tempfile
import threading
import time
from collections import Counter, deque
from collections.abc import Awaitable, Callable, Sequence
from concurrent.futures import Future
from dataclasses import dataclass, replace
from itertools import pairwise
from pathlib import Path
from typing import Any, Final, Generic, TypeVar

from bridge import exit_codes, reports
from bridge.errors import ConfigError
from bridge.files import clear_way, read_small, written_ns
from bridge.plain import from_json
from bridge.reports import PAGE, UNKEPT, Report
from gcs_plugin.job import Job
from tui.app.drawing import Line, Lines, apart, bar, cut, wrapped

Answer = TypeVar("Answer")
T = TypeVar("T")
BAR_CELLS: Final = 24
NOT_KEPT: Final = "its values are below, and kept nowhere"
MOST_SAID: Final = 50
LOOK_EVERY_S: Final = 0.05
ASKED: Final = {reports.VARIABLE: reports.FORM}
LEAVES: Final = ("--json", "--param", "--report", "--accept")
"""Options that name the files a verb leaves next to a dive, under names chosen by this program."""

CONFIRMED: Final = frozenset(("--yes", "--armed"))
"""Words of a verb that does to a vehicle what the crew has confirmed."""
ORDERED: Final = "ordered to end"


@dataclass(frozen=True)
class Done:
    """How a verb ended.

    Its exit code (`bridge.exit_codes`), its result as written to `--json`, None if there is none, its last lines of
    output other than progress, its errors, and the names of their classes.
    """

    code: int
    result: Any
    said: tuple[str, ...] = ()
    errors: tuple[str, ...] = ()
    error_names: tuple[str, ...] = ()

    @property
    def why(self) -> str:
        """Its errors as one text, or its last line if it reported none; empty if it said nothing."""
        return " ".join(self.errors or self.said[-1:])


Work = Callable[[Sequence[str], Callable[[Report], None], Callable[[], int]], Awaitable[Done]]


async def work(words: Sequence[str], hear: Callable[[Report], None], pressed: Callable[[], int]) -> Done:
    """Run the verb and its arguments in `words` to the end. If cancelled, end the verb and every process it started;
    but one of CONFIRMED words ends by ORDERED alone, and where the app is gone it is left to end in its own way.

    `pressed` returns how often its end key was pressed since the last call: it is passed on as Ctrl-C.

    If `words` contain `--json FILE`, the result is also in that file afterwards.
    """
    for option, place in pairwise(words):
        if option in LEAVES:
            clear_way(Path(place))
    with tempfile.TemporaryDirectory(prefix="seatrial-") as folder:
        if "--json" not in words:
            words = (*words, "--json", f"{folder}/result.json")
        result = Path(words[words.index("--json") + 1])
        before_ns = written_ns(result)
        job = Job(words[0], ("-m", "tui", *words), time.monotonic(), ASKED, errors_alone=True)
        said: deque[str] = deque(maxlen=MOST_SAID)
        errors: deque[Report] = deque(maxlen=MOST_SAID)
        try:
            presses = 0
            while job.code is None:
                # One at a time: a second Ctrl-C before the first is taken would be lost.
                presses += pressed()
                if presses:
                    presses -= 1
                    job.interrupt()
                for line in job.lines(time.monotonic()):
                    report = reports.read(line)
                    if report is None:
                        said.extend((line,) if line else ())
                    elif report.of == reports.ERROR:
                        errors.append(report)
                    else:
                        hear(report)
                await asyncio.sleep(LOOK_EVERY_S)
        except asyncio.CancelledError as cancelled:
            if cancelled.args != (ORDERED,) and not CONFIRMED.isdisjoint(words):
                raise
            job.cancel(time.monotonic())
            while job.code is None:
                job.lines(time.monotonic())
                await asyncio.sleep(LOOK_EVERY_S)
            raise
        # An unchanged file is the result of an earlier run.
        answer = json_in(result) if written_ns(result) != before_ns else None
    sentences, names = tuple(error.words for error in errors), tuple(error.stage for error in errors)
    return Done(job.code, answer, tuple(said), sentences, names)


@dataclass(frozen=True)
class JobState:
    """A running or finished verb. `words` is its command line; `reports` holds its progress, the oldest first.

    `done` is None while it runs. `cancelled` is set as soon as it is ordered to end; times are by the jobs' clock.
    """

    words: tuple[str, ...]
    began_s: float
    reports: tuple[Report, ...] = ()
    done: Done | None = None
    ended_s: float | None = None
    cancelled: bool = False

    @property
    def runs(self) -> bool:
        return self.done is None

    @property
    def draws(self) -> bool:
        """Whether it has reached its page: all other results are written by then."""
        return any(report.of == PAGE for report in self.reports)

    @property
    def unkept(self) -> Any:
        """Its result if that could not be written to its file; None if it was written or does not exist yet."""
        return next((report.result for report in self.reports if report.of == UNKEPT), None)

    @property
    def failure(self) -> str:
        """Why it ended without a result in its file; "" while it runs."""
        if self.done is None:
            return ""
        why = self.done.why or f"{self.words[0]} ended with exit code {self.done.code} and said nothing"
        return why if self.unkept is None else f"{why}; {NOT_KEPT}"

    @property
    def answered(self) -> bool:
        """Whether it has ended, or only has its page left to draw."""
        return not self.runs or self.draws


class Jobs:
    """At most one job per verb. `work` runs one job to its end, as the function `work` does."""

    def __init__(self, work: Work = work, clock: Callable[[], float] = time.monotonic) -> None:
        self._work, self._clock = work, clock
        self._states: dict[str, JobState] = {}
        self._tasks: dict[str, asyncio.Task[Done]] = {}
        self._presses: Counter[str] = Counter()

    def now_s(self) -> float:
        """Current time on the clock of `began_s` and `ended_s`."""
        return self._clock()

    def state(self, verb: str) -> JobState | None:
        """State of the verb's running or last job; None if there was none."""
        return self._states.get(verb)

    def about(self, verb: str, dive: object) -> JobState | None:
        """State of the verb's running job, whatever its dive, or of its last one if that was of this dive."""
        state = self.state(verb)
        return state if state is not None and (state.runs or state.words[1] == str(dive)) else None

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
        self._presses[verb] = 0
        task = asyncio.create_task(self._work_of(verb, tuple(words)), name=verb)
        task.add_done_callback(lambda ended: self._end(verb, ended))
        self._tasks[verb] = task

    def cancel(self, verb: str) -> bool:
        """End the job and all processes that it started; False if none runs. It is over once its state has a `done`."""
        if not self.runs(verb):
            return False
        self._change(verb, cancelled=True)
        self._tasks[verb].cancel(ORDERED)
        return True

    def press(self, verb: str) -> bool:
        """Press the job's end key, which it takes in its own way, as a flight does; False if none runs."""
        if not self.runs(verb):
            return False
        self._presses[verb] += 1
        return True

    async def _work_of(self, verb: str, words: tuple[str, ...]) -> Done:
        def hear(report: Report) -> None:
            self._change(verb, reports=(*self._states[verb].reports, report))

        try:
            return await self._work(words, hear, lambda: self._presses.pop(verb, 0))
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


async def aside(work: Callable[[], Answer]) -> Answer:
    """Return the result of `work`, or raise its exception."""
    future: Future[Answer] = Future()

    def run() -> None:
        try:
            future.set_result(work())
        except BaseException as error:  # noqa: BLE001 (re-raised in the waiting task)
            future.set_exception(error)

    threading.Thread(target=run, name="aside", daemon=True).start()
    # Shielded: a cancelled caller stops waiting, and the work can still deliver its result.
    return await asyncio.shield(asyncio.wrap_future(future))


class Kept(Generic[T]):
    """A job's result, read from its JSON once for each change of the file.

    `typed` converts the JSON to the type that a screen shows, or returns None if it does not fit.
    """

    def __init__(self, typed: Callable[[Any], T | None]) -> None:
        self._typed = typed
        self._of: tuple[Path, int] | None = None
        self._unkept: Any = None
        self._value: T | None = None

    def read(self, path: Path, unkept: Any = None) -> T | None:
        """The content of the file; None if the file is missing or has other content.

        `unkept` is a newer result that could not be written there: it replaces the file's content.
        """
        stamp = path, written_ns(path)
        if stamp != self._of or unkept is not self._unkept:
            self._of, self._unkept = stamp, unkept
            self._value = self._typed(json_in(path) if unkept is None else unkept)
        return self._value


def real(value: Any) -> float:
    """A number of a JSON file, NaN for null."""
    return math.nan if value is None else float(value)


def newer(path: Path, than: Path) -> bool:
    """Whether a file exists and is no older than `than`: then both come from the same run."""
    return written_ns(path) >= written_ns(than) > 0


def json_in(path: Path) -> Any:
    """The content of a JSON file; None if it can't be read."""
    try:
        return from_json(read_small(path))
    except (OSError, ValueError):
        return None


def progress(state: JobState, cells: int, begins: str = "begins") -> Line:
    """A bar, the share in per cent, and the current step; `begins` before the first report."""
    report = state.reports[-1] if state.reports else None
    share, words = (report.share, report.words) if report else (0.0, begins)
    per_cent = f" {100 * share:3.0f} %  "
    step = cut("ends" if state.cancelled else words, cells - BAR_CELLS - len(per_cent))
    return ((bar(share, BAR_CELLS), "accent"), (per_cent, "strong"), (step, "plain"))


def job_lines(verb: str, state: JobState | None, now_s: float, cells: int) -> Lines:
    """Progress or failure of a job; empty if there was no job or if it left a result, which is shown itself."""
    if state is None or not state.runs:
        return ended(verb, state, cells)
    lasted = f"  {now_s - state.began_s:.0f} s"
    return (apart(progress(state, cells - len(lasted) - 1), ((lasted, "quiet"),), cells),)


def ended(verb: str, state: JobState | None, cells: int) -> Lines:
    """How a job without a result ended."""
    if state is None or state.done is None:
        return ()
    if state.cancelled and state.draws:
        outcome = "what it found is below" if state.unkept is None else NOT_KEPT
        return wrapped(f"the page of {verb} was stopped by you; {outcome}", "warn", cells)
    if state.cancelled:
        return wrapped(f"{verb} was stopped by you; what lay there before stays", "warn", cells)
    if state.done.result is None or state.done.code == exit_codes.BAD_INPUT:
        return wrapped(state.failure, "bad", cells)
    return ()
