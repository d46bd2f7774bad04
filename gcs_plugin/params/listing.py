"""Reading all parameters: request the list, then the missing parameters by index, until a deadline. Pure."""

from dataclasses import dataclass
from typing import Final

from gcs_plugin.params.deadline import WINDOW, retry_delay_s
from gcs_plugin.peers import Source

NO_INDEX: Final = 65535
SILENCE_S: Final = 0.7
SHORT: Final = 100
EACH_S: Final = 0.1
"""More time for each parameter beyond SHORT: at a loss of 30 % each way a window of WINDOW brings about ten a
second."""


@dataclass(frozen=True, slots=True)
class ReadList:
    """A PARAM_REQUEST_LIST to send."""


@dataclass(frozen=True, slots=True)
class ReadIndex:
    """A PARAM_REQUEST_READ by index to send."""

    index: int


@dataclass
class Listing:
    """State machine that reads all parameters of a component.

    Call `on_value` and `on_reboot` as messages arrive, and send the messages that `tick` returns, until `done`.
    """

    source: Source
    start_s: float
    within_s: float

    def __post_init__(self) -> None:
        self._forget()
        self._next_list_s = self._last_new_s = self.start_s
        self._list_attempts = 0
        self._expired = False

    def _forget(self, count: int | None = None) -> None:
        """Discard all values; `count` is the number that the vehicle reports, None before its first PARAM_VALUE."""
        self.count = count
        self.values: dict[str, float] = {}
        self._name_at: dict[int, str] = {}
        self._next_ask_s: dict[int, float] = {}
        self._attempts: dict[int, int] = {}

    @property
    def limit_s(self) -> float:
        """Time that the reading may take: `within_s`, and more for an autopilot's long list."""
        return self.within_s + EACH_S * max(0, (self.count or 0) - SHORT)

    @property
    def missing(self) -> list[int]:
        """Indices of the parameters that have not arrived."""
        return [index for index in range(self.count or 0) if index not in self._name_at]

    @property
    def complete(self) -> bool:
        return self.count is not None and not self.missing

    @property
    def done(self) -> bool:
        return self.complete or self._expired

    def on_value(
        self, name: str, value: float, index: int, count: int, source: Source, time_s: float
    ) -> None:
        """A PARAM_VALUE arrived; a message without an index or from another component is ignored."""
        if source != self.source or index >= count or index == NO_INDEX:
            return
        if count != self.count or self._name_at.get(index, name) != name:
            # The parameter table differs from before: the vehicle was replaced, or rebooted.
            self._forget(count)
        if index not in self._name_at:
            self._last_new_s = time_s
        self._name_at[index] = name
        self.values[name] = value

    def on_reboot(self, time_s: float) -> None:
        """The vehicle rebooted: discard all values and read the list again."""
        self._forget()
        self._next_list_s, self._list_attempts = time_s + SILENCE_S, 0

    def tick(self, time_s: float) -> list[ReadList | ReadIndex]:
        if time_s - self.start_s >= self.limit_s:
            self._expired = True
        if self.done:
            return []
        if self.count is None:
            if time_s < self._next_list_s:
                return []
            self._list_attempts += 1
            self._next_list_s = time_s + SILENCE_S + retry_delay_s(self._list_attempts)
            return [ReadList()]
        if time_s - self._last_new_s < SILENCE_S and not self._attempts:
            return []
        return self._ask_missing(time_s)

    def _ask_missing(self, time_s: float) -> list[ReadList | ReadIndex]:
        sends: list[ReadList | ReadIndex] = []
        for index in self.missing[:WINDOW]:
            if time_s >= self._next_ask_s.get(index, time_s):
                self._attempts[index] = self._attempts.get(index, 0) + 1
                self._next_ask_s[index] = time_s + retry_delay_s(self._attempts[index])
                sends.append(ReadIndex(index))
        return sends
