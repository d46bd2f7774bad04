"""Clocks, passed as an argument: the clock that a vehicle boots with, real or simulated; dates in texts and names."""

import re
import time
from dataclasses import dataclass, field
from datetime import UTC, datetime
from typing import Final, Protocol


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
    """A clock whose Unix time never turns back: read once, it runs on with the boot time of `clock`."""

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


OLDEST_UNIX_S: Final = 1e9
"""A computer without a clock believes in 1970; no dive was recorded before this time (2001)."""


def utc_text(unix_s: float) -> str:
    """`2026-11-20T09:12:03Z`."""
    return f"{datetime.fromtimestamp(unix_s, UTC):%Y-%m-%dT%H:%M:%SZ}"


_IN_NAME = re.compile(r"(?<!\d)(\d{4})-(\d{2})-(\d{2})(?:T(\d{2})(\d{2})Z)?")


def date_in_name(name: str) -> float | None:
    """Unix time of a name such as `2026-11-20T0912Z-hovering` or `2026-11-20`; None if it holds no date."""
    match = _IN_NAME.search(name)
    if match is None:
        return None
    year, month, day, hour, minute = (int(part or 0) for part in match.groups())
    try:
        return datetime(year, month, day, hour, minute, tzinfo=UTC).timestamp()
    except ValueError:
        return None
