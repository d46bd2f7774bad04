"""Takes the set in force out of force, where none was before an upload: a pure state machine, as `transfer` is.

    RESTART (the scripts are started anew, sent once) -> a while, in which they load -> READ FF_ACTIVE, which must be 0
    after another answer, or none -> RESTART again, until the deadline

An applet takes a set out of force at its start alone, if the set's mark of the hull (FF_HULL) is not its own. The mark
was written and read back before; so a restart that is late, or a reboot in its place, comes to the same.
"""

from dataclasses import dataclass, field
from typing import Final

from bridge.vehicle.parameters import ACTIVE
from gcs_plugin.params.deadline import QUIET_S, RoundTrips
from gcs_plugin.params.transfer import Outcome, RestartScripts, Result, Send, Source, Transfer, confirm

HULL: Final = "FF_HULL"
"""The applet's mark of the hull that the set in force was committed on."""
NO_HULL: Final = 0.0
LOAD_S: Final = 5.0
"""For scripts to end and load: until then the autopilot answers for those before."""
READ_WITHIN_S: Final = 5.0


@dataclass
class Withdrawal:
    """No set in force on the vehicle component `source`, by a restart of its scripts, within `within_s` of `start_s`.

    Its words are those of `Transfer`; its one result is that of FF_ACTIVE.
    """

    source: Source
    start_s: float
    within_s: float
    round_trips: RoundTrips = field(default_factory=RoundTrips)

    def __post_init__(self) -> None:
        self._reading: Transfer | None = None
        self._read_from_s = self.start_s
        self._restarted = False
        self._result: Result | None = None

    @property
    def done(self) -> bool:
        return self._result is not None

    @property
    def waits(self) -> bool:
        """Whether no request is open now, as while the scripts load."""
        return self._reading is None or self._reading.waits

    @property
    def results(self) -> dict[str, Result]:
        return {} if self._result is None else {ACTIVE: self._result}

    @property
    def succeeded(self) -> bool:
        return self._result is not None and self._result.outcome is Outcome.APPLIED

    @property
    def progress(self) -> tuple[int, int]:
        return int(self.done), 1

    def failure(self) -> Result | None:
        return None if self.succeeded else self._result

    def on_value(self, name: str, value: float, source: Source, time_s: float) -> None:
        if self._reading is not None:
            self._reading.on_value(name, value, source, time_s)

    def on_error(self, name: str, code: int, source: Source) -> None:
        if self._reading is not None:
            self._reading.on_error(name, code, source)

    def on_reboot(self, time_s: float) -> None:
        """The vehicle rebooted, which starts its scripts anew too."""
        self._reading, self._read_from_s = None, time_s + LOAD_S

    def abort(self, sentence: str) -> None:
        if self._result is None:
            self._result = Result(Outcome.UNVERIFIED, sentence, None)

    def tick(self, time_s: float) -> list[Send]:
        if self._result is None and time_s - self.start_s >= self.within_s:
            self.abort(f"{ACTIVE} was not read back as 0 within {self.within_s:.0f} s")
        if self._result is not None:
            return []
        if not self._restarted:
            self._restarted, self._read_from_s = True, time_s + LOAD_S
            return [RestartScripts()]
        if time_s < self._read_from_s:
            return []
        if self._reading is None:
            within_s = READ_WITHIN_S + QUIET_S
            tasks = [confirm(ACTIVE, 0.0)]
            self._reading = Transfer(tasks, self.source, time_s, within_s, self.round_trips)
        sends: list[Send] = [*self._reading.tick(time_s)]
        if self._reading.succeeded:
            self._result = self._reading.results[ACTIVE]
        elif self._reading.done:
            self._reading, self._restarted = None, False
        return sends
