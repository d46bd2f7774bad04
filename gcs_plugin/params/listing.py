"""Reading all parameters: the list, then what is missing by index, until a deadline. Pure."""

from dataclasses import dataclass, field
from typing import Final

from gcs_plugin.params.deadline import Timing, is_past, retry_delay_s
from gcs_plugin.params.transfer import Source

NO_INDEX: Final = 65535
SILENCE_S: Final = 0.7


@dataclass(frozen=True, slots=True)
class ReadList:
    """A PARAM_REQUEST_LIST to send."""


@dataclass(frozen=True, slots=True)
class ReadIndex:
    """A PARAM_REQUEST_READ by index to send."""

    index: int


@dataclass
class Listing:
    """All parameters of one component. Feed it `on_value`, send what `tick` returns, until it is `done`."""

    source: Source
    start_s: float
    timing: Timing
    values: dict[str, float] = field(default_factory=dict)

    def __post_init__(self) -> None:
        self._count: int | None = None
        self._name_at: dict[int, str] = {}
        self._due_s: dict[int, float] = {}
        self._attempts: dict[int, int] = {}
        self._list_due_s = self.start_s
        self._list_attempts = 0
        self._last_new_s = self.start_s
        self._expired = False

    @property
    def count(self) -> int | None:
        """How many the vehicle says it has, None before it said so."""
        return self._count

    @property
    def missing(self) -> list[int]:
        """Indices that have not come."""
        return [index for index in range(self._count or 0) if index not in self._name_at]

    @property
    def complete(self) -> bool:
        return self._count is not None and not self.missing

    @property
    def done(self) -> bool:
        return self.complete or self._expired

    def on_value(
        self, name: str, value: float, index: int, count: int, source: Source, time_s: float
    ) -> None:
        """A PARAM_VALUE arrived; one without an index, or of another component, does not count."""
        if source != self.source or index >= count or index == NO_INDEX:
            return
        if count != self._count or self._name_at.get(index, name) != name:
            # Another table than before: the vehicle was changed or started anew.
            self._count, self._name_at, self.values = count, {}, {}
            self._due_s, self._attempts = {}, {}
        if index not in self._name_at:
            self._last_new_s = time_s
        self._name_at[index] = name
        self.values[name] = value

    def on_reboot(self, time_s: float) -> None:
        """The vehicle started again: begin anew."""
        self._count, self._name_at, self.values = None, {}, {}
        self._due_s, self._attempts = {}, {}
        self._list_due_s, self._list_attempts = time_s + SILENCE_S, 0

    def tick(self, time_s: float) -> list[ReadList | ReadIndex]:
        """What to send now."""
        if is_past(time_s, self.start_s, self.timing.deadline_s):
            self._expired = True
        if self.done:
            return []
        if self._count is None:
            if time_s < self._list_due_s:
                return []
            self._list_attempts += 1
            self._list_due_s = time_s + SILENCE_S + retry_delay_s(self._list_attempts, self.timing)
            return [ReadList()]
        if time_s - self._last_new_s < SILENCE_S and not self._attempts:
            return []
        return self._ask_missing(time_s)

    def _ask_missing(self, time_s: float) -> list[ReadList | ReadIndex]:
        sends: list[ReadList | ReadIndex] = []
        for index in self.missing[: self.timing.window]:
            if time_s >= self._due_s.get(index, time_s):
                self._attempts[index] = self._attempts.get(index, 0) + 1
                self._due_s[index] = time_s + retry_delay_s(self._attempts[index], self.timing)
                sends.append(ReadIndex(index))
        return sends
