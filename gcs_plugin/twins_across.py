"""Detection of two vehicles with the same MAVLink address on different links: neither link alone shows it.

A single vehicle may be heard on two links, with separate sequence numbers, but it has only one boot clock. Two vehicles
that were switched on within 5 s of each other can't be distinguished.
"""

from dataclasses import dataclass, field
from typing import Final

from pymavlink.dialects.v20 import ardupilotmega as dialect

from bridge.framing import Frame, decode
from gcs_plugin.senders import Senders
from gcs_plugin.turns import CLOCK_LATE_S, CLOCK_TURNS, HELD_S, Told, Turns
from gcs_plugin.twins import twins_sentence

MOST_LINKS: Final = 16
ON_S: Final = 2.0  # tolerance, s, within which a clock counts as going on unchanged


@dataclass
class _Clocks:
    """The boot clock of an address by link, with the time it was heard; `last` is the link that carried it last."""

    told: dict[str, tuple[Told, float]] = field(default_factory=dict)
    turns: Turns = field(default_factory=lambda: Turns(CLOCK_TURNS))
    last: str = ""

    def take(self, link: str, told: Told, now_s: float) -> None:
        here, last, self.last = self.told.get(link), self.told.get(self.last), link
        if here is not None or len(self.told) < MOST_LINKS:
            self.told[link] = told, now_s
        if last is None or now_s - last[1] > HELD_S or _apart_s(told, last[0]) <= CLOCK_LATE_S:
            return
        # A reboot, or a pause of the ground station, moves the clock on every link; clocks of twins go on unchanged.
        self.turns.change(here is not None and _apart_s(told, here[0]) <= ON_S, now_s)


def _apart_s(one: Told, other: Told) -> float:
    return abs(one.booted_s - other.booted_s)


class TwinsAcross:
    """Watches the boot clocks of all addresses over all links."""

    def __init__(self) -> None:
        self._now_s = 0.0
        self._clocks: Senders[_Clocks] = Senders()

    def on_frame(self, frame: Frame, link: str, time_s: float) -> None:
        """A frame arrived on the link of that name at `time_s`."""
        self._now_s = time_s
        if frame.message_id != dialect.MAVLINK_MSG_ID_SYSTEM_TIME or not frame.known:
            return
        message = decode(frame)
        source = (frame.system, frame.component)
        clocks = self._clocks.get(source) or _Clocks()
        if message is None or not self._clocks.put(source, time_s, clocks):
            return
        boot_s = message.time_boot_ms / 1e3
        clocks.take(link, Told(boot_s, time_s - boot_s), time_s)

    def fault(self, system: int | None) -> str:
        """Why no orders may be sent to this system, "" if they may."""
        for source, clocks in self._clocks.items():
            if source[0] == system and clocks.turns.are_two(self._now_s):
                return twins_sentence(" and ".join(sorted(clocks.told)), source)
        return ""
