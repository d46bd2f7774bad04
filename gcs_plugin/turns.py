"""Turns that two take under one name, by which they are told from one that starts anew."""

from dataclasses import dataclass
from typing import Final

CLOCK_TURNS: Final = 3
CLOCK_LATE_S: Final = 5.0  # so much later than before a clock may be heard and count as the same
HELD_S: Final = 20.0  # after the last turn: what took turns before has ended


@dataclass
class Turns:
    """The changes between two runs that follow each other closely; `seen_s` is when there were last enough."""

    enough: int
    turns: int = 0
    changed_s: float = 0.0
    seen_s: float | None = None

    def change(self, goes_on: bool, now_s: float) -> None:
        """It changed to another run, which goes on where it was left or not."""
        self.turns = self.turns + 1 if goes_on and now_s - self.changed_s <= HELD_S else 0
        self.changed_s = now_s
        if self.turns >= self.enough:
            self.seen_s = now_s

    def are_two(self, now_s: float) -> bool:
        return self.seen_s is not None and now_s - self.seen_s <= HELD_S


@dataclass(frozen=True)
class Told:
    """A time since boot, and the time of arrival less it, which only a delay or another clock makes larger."""

    boot_s: float
    booted_s: float
