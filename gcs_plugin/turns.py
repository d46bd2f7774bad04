"""Count of alternations between two senders with the same address, to distinguish them from a sender that reboots."""

from dataclasses import dataclass
from typing import Final

CLOCK_TURNS: Final = 3
CLOCK_LATE_S: Final = 5.0  # a boot clock delayed by no more than this still counts as the same
HELD_S: Final = 20.0  # after the last turn, until the alternation counts as ended


@dataclass
class Turns:
    """Number of successive changes between two runs; `seen_s` is when it last reached `enough`."""

    enough: int
    turns: int = 0
    changed_s: float = 0.0
    seen_s: float | None = None

    def change(self, goes_on: bool, now_s: float) -> None:
        """A change to the other run; `goes_on`: it continues from its last reading."""
        self.turns = self.turns + 1 if goes_on and now_s - self.changed_s <= HELD_S else 0
        self.changed_s = now_s
        if self.turns >= self.enough:
            self.seen_s = now_s

    def are_two(self, now_s: float) -> bool:
        return self.seen_s is not None and now_s - self.seen_s <= HELD_S


@dataclass(frozen=True)
class Told:
    """Reading of a boot clock: time since boot, s, and its arrival time minus that, which only a delay or another clock
    makes larger.
    """

    boot_s: float
    booted_s: float
