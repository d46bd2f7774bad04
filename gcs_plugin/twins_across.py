"""Two vehicles with one MAVLink address, each on a link of its own: neither link alone shows it.

One vehicle may well be heard on two links, with sequence numbers of their own; but it has one boot clock. Two that
were switched on within 5 s of each other are not told apart.
"""

from dataclasses import dataclass, field
from typing import Final

from pymavlink.dialects.v20 import ardupilotmega as dialect

from bridge.framing import Frame, decode
from gcs_plugin.senders import Senders
from gcs_plugin.turns import CLOCK_LATE_S, CLOCK_TURNS, HELD_S, Told, Turns
from gcs_plugin.twins import twins_sentence

MOST_LINKS: Final = 16
ON_S: Final = 2.0  # a clock that goes on as it was is not heard later than before by more


@dataclass
class _Clocks:
    """The boot clock of one address as each link tells it; `last` is the link that told it last."""

    told: dict[str, tuple[Told, float]] = field(default_factory=dict)
    turns: Turns = field(default_factory=lambda: Turns(CLOCK_TURNS))
    last: str = ""

    def take(self, link: str, told: Told, now_s: float) -> None:
        own, other, self.last = self.told.get(link), self.told.get(self.last), link
        if own is not None or len(self.told) < MOST_LINKS:
            self.told[link] = told, now_s
        if other is None or now_s - other[1] > HELD_S or _apart_s(told, other[0]) <= CLOCK_LATE_S:
            return
        # A restart, and a stop of the ground, move the clock of each link; of twins each goes on as it was.
        self.turns.change(own is not None and _apart_s(told, own[0]) <= ON_S, now_s)


def _apart_s(one: Told, other: Told) -> float:
    return abs(one.booted_s - other.booted_s)


class TwinsAcross:
    """Watches the boot clocks of every address over all links."""

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
        """Why nobody may order this system, "" where all is well."""
        for source, clocks in self._clocks.items():
            if source[0] == system and clocks.turns.are_two(self._now_s):
                return twins_sentence(" and ".join(sorted(clocks.told)), source)
        return ""
