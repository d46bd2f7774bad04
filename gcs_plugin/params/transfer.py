"""The parameter transfer: a pure state machine, without I/O and without a clock.

A task is done only when a read-back, requested after the last write and after a quiet period, equals the target float32
bit by bit. An echo of the write proves nothing: it only starts the quiet period, as do two writes without an echo. The
quiet period is longer than this vehicle's answers take to arrive (`RoundTrips`). A deadline ends the attempts, not a
count, unless the vehicle shows twice that it keeps another value.
"""

from collections.abc import Iterable
from dataclasses import dataclass, field
from enum import Enum, auto
from typing import Final

from bridge.vehicle.parameters import COMMIT, MODE
from gcs_plugin.params import float32
from gcs_plugin.params.deadline import WINDOW, RoundTrips, retry_delay_s
from gcs_plugin.peers import Source

DOES_NOT_EXIST: Final = 1
OUT_OF_RANGE: Final = 2
DENIED: Final = 3
COMPONENT_NOT_FOUND: Final = 4
ERROR_SENTENCES: Final = {
    1: "the vehicle has no such parameter",
    2: "the vehicle holds the value to be out of range",
    3: "the vehicle does not permit it now",
    4: "the vehicle has no such component",
    5: "the vehicle says that it is read-only",
    6: "the vehicle does not support its type",
    7: "the vehicle expects another type",
    8: "the vehicle could not read it",
}
NOT_FROM_HERE: Final = "the vehicle does not permit it; it may take orders from another ground alone"
NOT_KEPT: Final = (
    "the vehicle does not take it: its disk can't be written, a flight is under way, or it is armed and its "
    "feed-forward acts"
)
ANOTHER_WROTE: Final = (
    "the vehicle holds another set than was read back from it just now: another program wrote to it meanwhile"
)
REFUSALS_THAT_SETTLE: Final = 2
UNANSWERED_WRITES: Final = 2  # then the value is read back: some vehicles store a value and never echo it


class Outcome(Enum):
    """Outcome of a parameter or of a whole upload; the value is the sentence shown to the user."""

    APPLIED = "applied: an independent read-back equals it"
    SAME = "already so: nothing was written"
    REFUSED = "refused by the vehicle"
    UNVERIFIED = "unverified: no read-back confirmed it within the deadline"
    ROLLED_BACK = "rolled back to the value before the upload"
    NOT_SENT = "not sent"
    BEGUN = "begun: how it ended was never written down"


@dataclass(frozen=True, slots=True)
class Task:
    """Bring `name` to `value`: write it to `write_to` (None: never write), then read `name` back."""

    name: str
    value: float
    write_to: str | None


def write(name: str, value: float) -> Task:
    """Task: write a parameter and verify it by a read-back."""
    return Task(name, float32.rounded(value), name)


def confirm(name: str, value: float) -> Task:
    """Task: verify the value of a parameter by a read-back, and never write it."""
    return Task(name, float32.rounded(value), None)


@dataclass(frozen=True, slots=True)
class SetValue:
    """A PARAM_SET to send."""

    name: str
    value: float


@dataclass(frozen=True, slots=True)
class ReadValue:
    """A PARAM_REQUEST_READ to send."""

    name: str


@dataclass(frozen=True, slots=True)
class RestartScripts:
    """An order to send: the autopilot's scripts are to start anew."""


Request = SetValue | ReadValue
Send = Request | RestartScripts


@dataclass(frozen=True, slots=True)
class Result:
    """Result of a task; `seen` is the value of the last read-back, None if no read-back was answered."""

    outcome: Outcome
    sentence: str
    seen: float | None


class _State(Enum):
    WRITE = auto()
    ECHO = auto()
    QUIET = auto()
    READ = auto()
    ANSWER = auto()
    DONE = auto()


@dataclass
class _Item:
    task: Task
    state: _State
    due_s: float
    attempt: int = 0
    heard_echo: bool = False
    last_write_s: float | None = None
    quiet_since_s: float | None = None
    asked_s: float = 0.0
    refusals: int = 0
    refusal: str = ""
    seen: float | None = None
    result: Result | None = None

    @property
    def asks(self) -> bool:
        """Whether its request is being repeated, as opposed to a quiet period."""
        return self.state is _State.ANSWER or (self.state is _State.ECHO and self.quiet_since_s is None)


@dataclass
class Transfer:
    """Several tasks with the same vehicle component, under a common deadline.

    Call `on_value`, `on_error` and `on_reboot` as messages arrive, and send the messages that `tick` returns.
    Messages from another source, or about a parameter that no task waits for, change nothing. `round_trips` holds the
    link's round trips measured so far.
    """

    tasks: Iterable[Task]
    source: Source
    start_s: float
    within_s: float
    round_trips: RoundTrips = field(default_factory=RoundTrips)

    def __post_init__(self) -> None:
        self._items = [
            _Item(task, _State.READ if task.write_to is None else _State.WRITE, self.start_s)
            for task in self.tasks
        ]
        self._by_check = {item.task.name: item for item in self._items}
        self._by_write = {item.task.write_to: item for item in self._items if item.task.write_to}

    @property
    def done(self) -> bool:
        return all(item.state is _State.DONE for item in self._items)

    @property
    def waits(self) -> bool:
        """Whether no request is open now, as in a quiet period."""
        return not any(item.asks for item in self._items)

    @property
    def results(self) -> dict[str, Result]:
        """Results so far, by the name of the parameter that is read back."""
        return {item.task.name: item.result for item in self._items if item.result is not None}

    @property
    def succeeded(self) -> bool:
        return self.done and all(result.outcome is Outcome.APPLIED for result in self.results.values())

    @property
    def progress(self) -> tuple[int, int]:
        """Tasks done, tasks in all."""
        return sum(item.state is _State.DONE for item in self._items), len(self._items)

    def failure(self) -> Result | None:
        """The first result other than APPLIED, None if there is none."""
        return next((r for r in self.results.values() if r.outcome is not Outcome.APPLIED), None)

    def on_value(self, name: str, value: float, source: Source, time_s: float) -> None:
        if source != self.source:
            return
        self.round_trips.on_heard(name, time_s)
        writing = self._by_write.get(name)
        if writing is not None and writing.state is _State.ECHO:
            writing.heard_echo = True
            self._be_quiet(writing, writing.last_write_s)
        reading = self._by_check.get(name)
        if reading is not None and reading.state is _State.ANSWER:
            if reading.asked_s < self._quiet_until_s(reading):
                # Requested too soon, by the round trips measured since: this may be the echo of a write.
                self._be_quiet(reading, reading.quiet_since_s)
            else:
                self._judge(reading, value, time_s)

    def on_error(self, name: str, code: int, source: Source) -> None:
        """A PARAM_ERROR arrived; a read-back still decides, unless the parameter or the component does not exist."""
        item = self._by_write.get(name) or self._by_check.get(name)
        if source != self.source or item is None or item.state in (_State.WRITE, _State.DONE):
            return
        sentence = ERROR_SENTENCES.get(code, f"the vehicle answers error {code}")
        if name == COMMIT and code == OUT_OF_RANGE:
            sentence = ANOTHER_WROTE
        elif name == COMMIT and code == DENIED:
            sentence = NOT_KEPT
        elif name != MODE and code == DENIED:
            sentence = NOT_FROM_HERE
        if code in (DOES_NOT_EXIST, COMPONENT_NOT_FOUND):
            self._finish(item, Outcome.REFUSED, f"{name} refused: {sentence}")
            return
        item.refusal = sentence
        if item.state is _State.ECHO:
            item.heard_echo = True
            self._be_quiet(item, item.last_write_s)

    def on_reboot(self, time_s: float) -> None:
        """The vehicle rebooted: verify again all that was verified before."""
        for item in self._items:
            refused = item.result is not None and item.result.outcome is not Outcome.APPLIED
            if refused or item.state is _State.WRITE:
                continue
            item.result, item.heard_echo = None, False
            self._be_quiet(item, time_s)

    def abort(self, sentence: str) -> None:
        """End at once: tasks that were written end UNVERIFIED, tasks never written end NOT_SENT."""
        for item in self._items:
            if item.state is not _State.DONE:
                sent = item.last_write_s is not None
                self._finish(item, Outcome.UNVERIFIED if sent else Outcome.NOT_SENT, sentence)

    def tick(self, time_s: float) -> list[Request]:
        if time_s - self.start_s >= self.within_s:
            for item in self._items:
                if item.state is not _State.DONE:
                    self._expire(item)
            return []
        sends: list[Request] = []
        flying = sum(item.state in (_State.ECHO, _State.ANSWER) for item in self._items)
        for item in self._items:
            if item.state is _State.DONE or time_s < max(item.due_s, self._quiet_until_s(item)):
                continue
            if item.state is _State.QUIET:
                item.state, item.attempt = _State.READ, 0
            if item.state in (_State.WRITE, _State.READ):
                if flying >= WINDOW:
                    continue
                flying += 1
            sends.append(self._send(item, time_s))
            if item.attempt == 1:
                self.round_trips.on_quiet(sends[-1].name)
        for send in sends:
            self.round_trips.on_sent(send.name, time_s)
        return sends

    def _send(self, item: _Item, time_s: float) -> Request:
        if item.state is _State.ECHO and item.attempt >= UNANSWERED_WRITES:
            item.state, item.attempt = _State.ANSWER, 0
        item.attempt += 1
        item.due_s = time_s + retry_delay_s(item.attempt)
        if item.state in (_State.WRITE, _State.ECHO) and item.task.write_to is not None:
            item.state, item.last_write_s = _State.ECHO, time_s
            item.quiet_since_s = time_s if item.attempt >= UNANSWERED_WRITES else None
            return SetValue(item.task.write_to, item.task.value)
        if item.attempt == 1:
            item.asked_s = time_s
        item.state = _State.ANSWER
        return ReadValue(item.task.name)

    def _be_quiet(self, item: _Item, since_s: float | None) -> None:
        item.state, item.attempt, item.quiet_since_s = _State.QUIET, 0, since_s

    def _quiet_until_s(self, item: _Item) -> float:
        """Time at which no earlier message is under way any more, by the round trips measured so far."""
        return self.start_s if item.quiet_since_s is None else item.quiet_since_s + self.round_trips.quiet_s

    def _judge(self, item: _Item, value: float, time_s: float) -> None:
        item.seen = value
        if float32.same(value, item.task.value):
            sentence = f"{item.task.name} = {float32.text(item.task.value)}"
            self._finish(item, Outcome.APPLIED, sentence)
            return
        if item.task.write_to is None:
            self._finish(
                item, Outcome.REFUSED, f"{item.task.name} holds {value:.9g}, not {item.task.value:.9g}"
            )
            return
        if item.heard_echo:
            item.refusals += 1
        if item.refusals and (item.refusal or item.refusals >= REFUSALS_THAT_SETTLE):
            why = item.refusal or f"the vehicle keeps {value:.9g}"
            self._finish(
                item, Outcome.REFUSED, f"{item.task.write_to} = {item.task.value:.9g} refused: {why}"
            )
            return
        # Another quiet period, so that a duplicate of this answer can't pass for the echo of the next write.
        item.state, item.attempt, item.heard_echo, item.quiet_since_s = _State.WRITE, 0, False, time_s

    def _expire(self, item: _Item) -> None:
        if item.last_write_s is None and item.task.write_to is not None:
            self._finish(item, Outcome.NOT_SENT, f"{item.task.name} was not sent before the deadline")
            return
        last = f", last seen {item.seen:.9g}" if item.seen is not None else ""
        allowed = self.within_s
        sentence = f"{item.task.name} was not read back as {item.task.value:.9g} within {allowed:.0f} s{last}"
        self._finish(item, Outcome.UNVERIFIED, sentence)

    def _finish(self, item: _Item, outcome: Outcome, sentence: str) -> None:
        item.state, item.result = _State.DONE, Result(outcome, sentence, item.seen)
