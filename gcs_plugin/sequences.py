"""The runs of a component's sequence numbers and of its boot clock: losses, reboots, and two senders in one. Pure.

A boot clock that runs back by more than `BACK_S` is a new boot: frames may arrive late, never early, so that delay
alone never moves it that far. Two vehicles under one address show by a boot clock, or sequence numbers on a link, that
jump back and forth: a reboot changes the clock once, and the old clock is not heard again.
"""

import math
from dataclasses import dataclass, field
from typing import Final

from bridge.wire.silences import BACK_S

SEQUENCES: Final = 256
LATE: Final = 128  # a gap that wide is a frame that arrived late, not half a cycle of lost frames
ALL_HEARD: Final = (1 << LATE) - 1
RESTART_S: Final = 5.0  # after such a silence the sequence numbers may have started again
CLOCK_LATE_S: Final = 5.0  # a boot clock delayed by no more than this still counts as the same
CLOCK_TURNS: Final = 3
SEQUENCE_TURNS: Final = 6
SEQUENCE_NEAR: Final = 32
HELD_S: Final = 20.0  # after the last turn, until the alternation counts as ended
GOES_ON_S: Final = 3.0
GOES_ON_TIMES: Final = 3
ROUND_S: Final = 2**32 / 1e3
"""Boot times in 32 bits of milliseconds begin anew after 49.7 days."""
ROUND_WITHIN_S: Final = 60.0
"""A boot time so near to the one that is due, but for a whole round, has gone round."""
SAME_BOOT_S: Final = 0.02
"""Boots whose Unix times differ by less are the same boot, heard again from a recording: a real reboot is later."""


@dataclass(slots=True)
class Alternation:
    """Counts successive changes between two runs; `seen_s` is when they were last `enough` to mean two senders."""

    enough: int
    turns: int = 0
    changed_s: float = 0.0
    seen_s: float = -math.inf

    def change(self, goes_on: bool, now_s: float) -> None:
        """A change to the other run; `goes_on`: it continues from its last reading."""
        self.turns = self.turns + 1 if goes_on and now_s - self.changed_s <= HELD_S else 0
        self.changed_s = now_s
        if self.turns >= self.enough:
            self.seen_s = now_s

    def is_seen(self, now_s: float) -> bool:
        return now_s - self.seen_s <= HELD_S


@dataclass(slots=True)
class OnLink:
    """A component on one link: its sequence numbers, the losses by them, its last HEARTBEAT and boot time.

    `heard`: bit k is set where the frame k numbers back has come, or was not to come here; `again`: frames since the
    last boot time whose numbers had come.
    """

    sequence: int
    last_s: float
    received: int = 1
    lost: int = 0
    boot_s: float = -math.inf
    lost_by_then: int = 0
    beat_s: float = -math.inf
    heard: int = ALL_HEARD
    again: int = 0
    run: int = -1
    run_left: int = -1
    runs: Alternation = field(default_factory=lambda: Alternation(SEQUENCE_TURNS))

    def hear(self, sequence: int, time_s: float) -> None:
        if (sequence - self.run + SEQUENCE_NEAR) % SEQUENCES > 2 * SEQUENCE_NEAR:
            goes_on = self.run_left >= 0 and (sequence - self.run_left) % SEQUENCES <= SEQUENCE_NEAR
            self.runs.change(goes_on, time_s)
            self.run_left = self.run
        self.run = sequence
        gap = (sequence - self.sequence - 1) % SEQUENCES
        silent_s, self.last_s = time_s - self.last_s, time_s
        if silent_s > RESTART_S:
            gap, self.heard = 0, ALL_HEARD
        if gap >= LATE:
            place = 1 << SEQUENCES - 1 - gap
            if self.heard & place:  # a duplicate, which makes up for no loss
                self.again += 1
                return
            self.heard |= place
            self.received += 1
            self.lost = max(0, self.lost - 1)
            return
        self.received += 1
        self.lost += gap
        self.sequence = sequence
        self.heard = (self.heard << gap + 1 | 1) & ALL_HEARD

    def hear_clock(self, boot_s: float, sequence: int) -> bool:
        """Return whether the boot clock ran back, and undo the loss counted since its last reading if so.

        A component that rebooted starts its sequence numbers again, so the frames that seemed lost since were not, and
        those whose numbers had come were no duplicates.
        """
        ran_back = boot_s < self.boot_s - BACK_S
        if ran_back:
            self.lost, self.sequence, self.heard = self.lost_by_then, sequence, ALL_HEARD
            self.received += self.again
        self.boot_s, self.lost_by_then, self.again = boot_s, self.lost, 0
        return ran_back


@dataclass(frozen=True, slots=True)
class BootReading:
    """A boot time that arrived on `link`; `booted_s`: arrival minus boot time, which only delay makes larger.

    `unix_s` is the Unix time of the boot by the sender's own clock, NaN if it knows no date.
    """

    boot_s: float
    booted_s: float
    unix_s: float
    link: str

    @property
    def arrived_s(self) -> float:
        return self.boot_s + self.booted_s


@dataclass(slots=True)
class _NewRun:
    """A run of the boot clock that may have begun; `is_real`: it can't come from a recording that is played."""

    first: BootReading
    last: BootReading
    is_real: bool
    times: int = 1


@dataclass(slots=True)
class BootClock:
    """The boot clock of a component over all links: `first` and `last` reading of its run.

    A late frame carries an old boot time once, between newer boot times; a growing queue delays all frames and turns
    nothing back. So a reboot is confirmed when the new run goes on for `GOES_ON_S` without a boot time of the old.
    After a real reboot the clock shows no more than the silence before it; that of a recording that is played again,
    or of a second link that lags, shows more.
    """

    first: BootReading
    last: BootReading
    new: _NewRun | None = None
    current: BootReading | None = None
    left: BootReading | None = None
    turns: Alternation = field(default_factory=lambda: Alternation(CLOCK_TURNS))

    def hear(self, now: BootReading, time_s: float) -> BootReading | None:
        """A boot time arrived; return the first boot time of the new run once a reboot is confirmed, otherwise None."""
        current, self.current = self.current, now
        if current is not None and abs(now.booted_s - current.booted_s) > CLOCK_LATE_S:
            left, self.left = self.left, current
            goes_on = left is not None and abs(now.booted_s - left.booted_s) <= CLOCK_LATE_S
            self.turns.change(goes_on, time_s)
        new = self.new
        # Delay moves both clocks the same way: a boot instant nearer to the new clock's, or later, is the new clock's.
        is_of_new = new is not None and 2 * now.booted_s > self.last.booted_s + new.last.booted_s
        if not is_of_new and now.boot_s >= self.last.boot_s - BACK_S:
            self.new = None
            if now.boot_s > self.last.boot_s:
                self.last = now
        elif new is None or now.boot_s < new.last.boot_s - BACK_S:
            self.new = _NewRun(now, now, self._is_real(now))
        elif is_of_new and now.boot_s > new.last.boot_s:
            new.last = now
            new.times += 1
            if new.times >= GOES_ON_TIMES and now.arrived_s - new.first.arrived_s >= GOES_ON_S:
                self.first, self.last, self.new = new.first, new.last, None
                return new.first if new.is_real else None
        return None

    def unwrapped(self, boot_s: float, time_s: float) -> float:
        """The boot time that arrived at `time_s`, with the rounds that the clock has made in this run."""
        due_s = time_s - self.last.booted_s
        whole_s = boot_s + ROUND_S * round((due_s - boot_s) / ROUND_S)
        return whole_s if abs(whole_s - due_s) <= ROUND_WITHIN_S else boot_s

    def _is_real(self, now: BootReading) -> bool:
        """Whether a vehicle last heard in this run can have rebooted in its silence, and this is not the same boot."""
        silent_s = now.arrived_s - self.last.arrived_s
        same = any(abs(now.unix_s - run.unix_s) <= SAME_BOOT_S for run in (self.first, self.last))
        return now.boot_s <= silent_s + CLOCK_LATE_S and not same
