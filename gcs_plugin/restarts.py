"""Detection of a vehicle that reboots while it is heard: its boot clock runs back, and goes on from there.

A late frame carries an old boot time once, between newer boot times; a growing queue delays all frames and turns
nothing back. So a reboot is confirmed when the new clock goes on for `GOES_ON_S` without a boot time of the old clock.
After a real reboot, the boot clock shows no more than the silence before it; the clock of a recording that is played
back, or of a second link that lags, shows more.
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
"""Boots whose Unix times differ by less are the same boot, heard again from a recording: a real reboot is later."""

_HEARTBEAT: Final[int] = dialect.MAVLINK_MSG_ID_HEARTBEAT
_SYSTEM_TIME: Final[int] = dialect.MAVLINK_MSG_ID_SYSTEM_TIME
_DAY_S, _HOUR_S, _MINUTE_S = 86_400, 3600, 60


@dataclass(frozen=True, slots=True)
class Restart:
    """Reboot of a component at `booted_s` on the clock of the arrivals; `boot_s` is the first boot time heard since."""

    source: Source
    booted_s: float
    boot_s: float

    def words(self, unix_at_zero_s: float) -> str:
        """Message to the crew; `unix_at_zero_s` is Unix time minus the clock of the arrivals, NaN if not known."""
        system, component = self.source
        who = f"vehicle {system}"
        if component != dialect.MAV_COMP_ID_AUTOPILOT1:
            who += f" (component {component})"
        unix_s = unix_at_zero_s + self.booted_s
        at = f" at {_time_of_day(unix_s)} UTC" if math.isfinite(unix_s) else ""
        return f"{who} started anew{at} (its clock went back to {self.boot_s:.0f} s)"


@dataclass
class _Run:
    """A run of a boot clock: its last reading, and the Unix time at boot by its first and last reading, NaN if none."""

    told: Told
    first_unix_s: float
    last_unix_s: float

    def go_on(self, told: Told, unix_s: float) -> None:
        self.told, self.last_unix_s = told, unix_s

    def is_same_boot(self, unix_s: float) -> bool:
        return any(abs(unix_s - booted) <= SAME_BOOT_S for booted in (self.first_unix_s, self.last_unix_s))


@dataclass
class _New:
    """A run that may have begun: `first` is its first boot time; `is_real`: it can't come from a recording."""

    run: _Run
    first: Told
    is_real: bool
    times: int = 1


@dataclass
class _Sender:
    """State of a component; `is_vehicle`: its HEARTBEAT is that of a vehicle."""

    is_vehicle: bool = False
    run: _Run | None = None
    new: _New | None = None

    def take(self, told: Told, unix_s: float) -> Told | None:
        """A boot time arrived; return the first boot time of the new run once a reboot is confirmed, otherwise None."""
        run, new = self.run, self.new
        if run is None:
            self.run = _Run(told, unix_s, unix_s)
            return None
        # Delay moves both clocks the same way: a boot instant nearer to the new clock's, or later, is the new clock's.
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
    """Watches the boot clocks of all components of vehicles, over all links."""

    def __init__(self) -> None:
        self._senders: Senders[_Sender] = Senders()

    def on_frame(self, frame: Frame, time_s: float) -> Restart | None:
        """A frame arrived at `time_s`, which never runs back; return the restart that it confirms, None if none."""
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
    """Whether a vehicle last heard in run `before` can have rebooted within its silence, and has not the same boot."""
    silent_s = _arrival_s(told) - _arrival_s(before.told)
    return told.boot_s <= silent_s + CLOCK_LATE_S and not before.is_same_boot(unix_s)


def _arrival_s(told: Told) -> float:
    return told.boot_s + told.booted_s


def _time_of_day(unix_s: float) -> str:
    second = int(unix_s) % _DAY_S
    return f"{second // _HOUR_S:02d}:{second % _HOUR_S // _MINUTE_S:02d}:{second % _MINUTE_S:02d}"
