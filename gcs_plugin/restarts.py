"""A vehicle that starts anew while it is listened to: its boot clock runs back, and goes on from there.

A frame that comes late tells an old boot time once, between newer ones; a queue that grows delays all, and turns
nothing back. So a clock is believed to have started anew where it goes on for `GOES_ON_S` without a word of the old
one. A vehicle's clock is then no older than the silence before it; that of a recording that is played back, or of a
second link that lags, is older.
"""

import math
from dataclasses import dataclass
from typing import Final

from pymavlink.dialects.v20 import ardupilotmega as dialect

from bridge.framing import Frame, decode
from gcs_plugin.senders import Senders, Source
from gcs_plugin.turns import CLOCK_LATE_S, Told
from gcs_plugin.twins import CLOCK_APART_S

GOES_ON_S: Final = 3.0
TOLD_TIMES: Final = 3
SAME_BOOT_S: Final = 0.02
"""Two boots at one date to within so little are one, which a recording tells again: a real one is later."""

_HEARTBEAT: Final[int] = dialect.MAVLINK_MSG_ID_HEARTBEAT
_SYSTEM_TIME: Final[int] = dialect.MAVLINK_MSG_ID_SYSTEM_TIME
_DAY_S, _HOUR_S, _MINUTE_S = 86_400, 3600, 60


@dataclass(frozen=True, slots=True)
class Restart:
    """`booted_s` is when, on the clock of the arrivals; `boot_s` is the first time since then that it told."""

    source: Source
    booted_s: float
    boot_s: float

    def words(self, unix_at_zero_s: float) -> str:
        """For a crew; `unix_at_zero_s` is Unix time less that of the arrivals, NaN where nobody knows the date."""
        system, component = self.source
        who = f"vehicle {system}"
        if component != dialect.MAV_COMP_ID_AUTOPILOT1:
            who += f" (component {component})"
        unix_s = unix_at_zero_s + self.booted_s
        at = f" at {_time_of_day(unix_s)} UTC" if math.isfinite(unix_s) else ""
        return f"{who} started anew{at} (its clock went back to {self.boot_s:.0f} s)"


@dataclass
class _Run:
    """One run of a boot clock: what it told last, and its Unix time at boot as first and last told, NaN for none."""

    told: Told
    first_unix_s: float
    last_unix_s: float

    def go_on(self, told: Told, unix_s: float) -> None:
        self.told, self.last_unix_s = told, unix_s

    def is_same_boot(self, unix_s: float) -> bool:
        return any(abs(unix_s - own) <= SAME_BOOT_S for own in (self.first_unix_s, self.last_unix_s))


@dataclass
class _New:
    """A run that may have begun: `first` is what it told first, `is_real` that no recording can have told it."""

    run: _Run
    first: Told
    is_real: bool
    times: int = 1


@dataclass
class _Sender:
    """One component; `is_vehicle` once it beat as one."""

    is_vehicle: bool = False
    run: _Run | None = None
    new: _New | None = None

    def take(self, told: Told, unix_s: float) -> Told | None:
        """A boot time came; the first of the new run once that is sure."""
        run, new = self.run, self.new
        if run is None:
            self.run = _Run(told, unix_s, unix_s)
            return None
        # Delay moves both clocks the same way: what lies nearer to the new one, or behind it, is of the new one.
        is_of_new = new is not None and 2 * told.booted_s > run.told.booted_s + new.run.told.booted_s
        if not is_of_new and told.boot_s >= run.told.boot_s - CLOCK_APART_S:
            self.new = None
            if told.boot_s > run.told.boot_s:
                run.go_on(told, unix_s)
        elif new is None or told.boot_s < new.run.told.boot_s - CLOCK_APART_S:
            self.new = _New(_Run(told, unix_s, unix_s), told, _is_real(run, told, unix_s))
        elif is_of_new and told.boot_s > new.run.told.boot_s:
            new.run.go_on(told, unix_s)
            new.times += 1
            if new.times >= TOLD_TIMES and _arrival_s(told) - _arrival_s(new.first) >= GOES_ON_S:
                self.run, self.new = new.run, None
                return new.first if new.is_real else None
        return None


class Restarts:
    """Watches the boot clock of every vehicle's components, whichever link they come by."""

    def __init__(self) -> None:
        self._senders: Senders[_Sender] = Senders()

    def on_frame(self, frame: Frame, time_s: float) -> Restart | None:
        """A frame arrived at `time_s`, which never runs back; the restart that it makes sure of, None for none."""
        if not frame.known or frame.message_id not in (_HEARTBEAT, _SYSTEM_TIME):
            return None
        source = (frame.system, frame.component)
        sender = self._senders.get(source) or _Sender()
        if not self._senders.put(source, time_s, sender):
            return None
        message = decode(frame)
        if message is None:
            return None
        if frame.message_id == _HEARTBEAT:
            sender.is_vehicle = message.type != dialect.MAV_TYPE_GCS and (
                message.autopilot != dialect.MAV_AUTOPILOT_INVALID
                or message.type == dialect.MAV_TYPE_ONBOARD_CONTROLLER
            )
            return None
        boot_s, unix_s = message.time_boot_ms / 1e3, message.time_unix_usec / 1e6
        first = sender.take(Told(boot_s, time_s - boot_s), unix_s - boot_s if unix_s else math.nan)
        if first is None or not sender.is_vehicle:
            return None
        return Restart(source, first.booted_s, first.boot_s)


def _is_real(before: _Run, told: Told, unix_s: float) -> bool:
    """Whether a vehicle that was heard as `before` can have started so late, and it is not that very boot again."""
    silent_s = _arrival_s(told) - _arrival_s(before.told)
    return told.boot_s <= silent_s + CLOCK_LATE_S and not before.is_same_boot(unix_s)


def _arrival_s(told: Told) -> float:
    return told.boot_s + told.booted_s


def _time_of_day(unix_s: float) -> str:
    second = int(unix_s) % _DAY_S
    return f"{second // _HOUR_S:02d}:{second % _HOUR_S // _MINUTE_S:02d}:{second % _MINUTE_S:02d}"
