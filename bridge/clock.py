"""Clocks, passed as an argument: the clock that a vehicle boots with, real or simulated."""

import time
from dataclasses import dataclass, field
from typing import Protocol


class Clock(Protocol):
    """Boot time only runs forward. Unix time is the date as the computer believes it to be."""

    def boot_s(self) -> float: ...

    def unix_s(self) -> float: ...


@dataclass(frozen=True)
class SystemClock:
    """The computer's own clocks; boot time starts when the object is created."""

    started_s: float = field(default_factory=time.monotonic)

    def boot_s(self) -> float:
        return time.monotonic() - self.started_s

    def unix_s(self) -> float:
        return time.time()


class EvenClock:
    """`clock` with a Unix time that is read once and runs on with boot time: setting the date turns nothing back."""

    def __init__(self, clock: Clock) -> None:
        self._clock = clock
        self._unix_at_boot_s = clock.unix_s() - clock.boot_s()

    def boot_s(self) -> float:
        return self._clock.boot_s()

    def unix_s(self) -> float:
        return self._unix_at_boot_s + self._clock.boot_s()


@dataclass
class SimulatedClock:
    """A clock that stands still until `advance_to` moves it."""

    now_s: float = 0.0
    unix_at_boot_s: float = 1_790_000_000.0

    def boot_s(self) -> float:
        return self.now_s

    def unix_s(self) -> float:
        return self.unix_at_boot_s + self.now_s

    def advance_to(self, boot_s: float) -> None:
        if boot_s < self.now_s:
            raise ValueError(f"a clock can't run back from {self.now_s} s to {boot_s} s")
        self.now_s = boot_s
