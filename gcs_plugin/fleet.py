"""Vehicles heard on the links of the ground station, and the choice of the vehicle that orders go to.

Pure: takes frames with their arrival times, returns the vehicle to send orders to. If the choice is not clear, an error
is raised and nothing may be sent.
"""

from dataclasses import dataclass, field
from typing import Any, Final

from pymavlink.dialects.v20 import ardupilotmega as dialect

from bridge.errors import LinkError, LinkTimeout
from bridge.framing import Frame, decode
from bridge.link.base import Link
from gcs_plugin.link_health import LinkHealth, SourceHealth
from gcs_plugin.params.client import COMPANIONS, COMPANIONS_MAY_FOLLOW_S, REBOOT_STEP_MS, Heard
from gcs_plugin.params.transfer import Source
from gcs_plugin.senders import Senders
from gcs_plugin.twins import Twins
from gcs_plugin.twins_across import TwinsAcross

SILENT_S: Final = 6.0
"""A vehicle without a HEARTBEAT for longer counts as absent: a false alarm once in a thousand, at 30 % loss of 1 Hz."""

LINE_GONE_S: Final = 300.0
"""A link that carried nothing for longer, while others did, is forgotten."""

_USED: Final = frozenset(
    (
        dialect.MAVLINK_MSG_ID_HEARTBEAT,
        dialect.MAVLINK_MSG_ID_SYSTEM_TIME,
        dialect.MAVLINK_MSG_ID_PARAM_VALUE,
        dialect.MAVLINK_MSG_ID_PARAM_ERROR,
    )
)


@dataclass(frozen=True, slots=True)
class News:
    """A message for the parameter code; `rebooted`: it shows that its sender has rebooted."""

    source: Source
    message: Any
    rebooted: bool = False


@dataclass
class _Line:
    """State of a link: its health, vehicles that share an address on it, and the time of its last frame, `heard_s`."""

    twins: Twins
    health: LinkHealth = field(default_factory=LinkHealth)
    heard_s: float = 0.0


@dataclass
class _Sender:
    """State of a component: the link of its last frame, its last HEARTBEAT, its boot clock."""

    link: str
    heard: Heard | None = None
    boot_ms: int | None = None


class Fleet:
    """All senders heard on any link. `chosen` is the system that orders go to, None for the only vehicle."""

    def __init__(self) -> None:
        self.chosen: int | None = None
        self._lines: dict[str, _Line] = {}
        self._senders: Senders[_Sender] = Senders()
        self._since_s: dict[int, float] = {}
        self._across = TwinsAcross()

    def on_frame(self, frame: Frame, link: Link, time_s: float) -> News | None:
        """A frame arrived on `link`; return its message if the parameter code uses that kind, otherwise None."""
        line = self._line(link, time_s)
        line.health.on_frame(frame, time_s)
        line.twins.on_frame(frame, time_s)
        self._across.on_frame(frame, link.name, time_s)
        source = (frame.system, frame.component)
        sender = self._senders.get(source) or _Sender(link.name)
        if not frame.known or not self._senders.put(source, time_s, sender):
            return None
        sender.link = link.name
        message = decode(frame) if frame.message_id in _USED else None
        if message is None:
            return None
        if frame.message_id == dialect.MAVLINK_MSG_ID_HEARTBEAT:
            is_station = message.type == dialect.MAV_TYPE_GCS
            armed = bool(message.base_mode & dialect.MAV_MODE_FLAG_SAFETY_ARMED) and not is_station
            sender.heard = Heard(source, message.type, message.autopilot, armed, time_s)
            self._since_s.setdefault(frame.system, time_s)
        elif frame.message_id == dialect.MAVLINK_MSG_ID_SYSTEM_TIME:
            before, sender.boot_ms = sender.boot_ms, message.time_boot_ms
            return News(
                source, message, before is not None and message.time_boot_ms < before - REBOOT_STEP_MS
            )
        return News(source, message)

    def choose(self, system: int | None, now_s: float) -> Source | None:
        """Choose a system, or with None whichever vehicle is alone, and return its component as `meant` does.

        Raises LinkError for a system that sends no HEARTBEAT, and the errors of `meant`.
        """
        if system is not None and system not in self.systems(now_s):
            there = ", ".join(map(str, self.systems(now_s))) or "none"
            raise LinkError(f"no vehicle beats as system {system}; these do: {there}")
        self.chosen = system
        return None if system is None else self.meant(now_s)

    def systems(self, now_s: float) -> tuple[int, ...]:
        """Systems of the vehicles that send HEARTBEATs."""
        return tuple(sorted({source[0] for source in self._beating(now_s)}))

    def meant(self, now_s: float) -> Source:
        """The component with the parameters of the chosen vehicle: a companion before an autopilot.

        Raises LinkTimeout if no vehicle, or not the chosen vehicle, sends HEARTBEATs, or if it was first heard so
        recently that a companion may still follow; LinkError if several vehicles send HEARTBEATs and none is chosen, or
        if two vehicles share its address.
        """
        systems = self.systems(now_s)
        if self.chosen is not None:
            if self.chosen not in systems:
                raise LinkTimeout(
                    f"vehicle {self.chosen} has not beaten for {SILENT_S:.0f} s; check its link, "
                    "or choose another: seatrial vehicle N"
                )
            systems = (self.chosen,)
        if not systems:
            raise LinkTimeout("no vehicle beats on any link; check cable, address, and that the bridge runs")
        if len(systems) > 1:
            there = ", ".join(map(str, systems))
            raise LinkError(
                f"several vehicles beat (systems {there}) and none is chosen; choose one: seatrial vehicle {systems[0]}"
            )
        fault = self.fault(systems[0])
        if fault:
            raise LinkError(fault)
        if now_s - self._since_s[systems[0]] < COMPANIONS_MAY_FOLLOW_S:
            raise LinkTimeout(f"vehicle {systems[0]} was heard only just now; try again in two seconds")
        candidates = [source for source in self._beating(now_s) if source[0] == systems[0]]
        return min(candidates, key=lambda source: (source[1] not in COMPANIONS, source[1]))

    def fault(self, system: int) -> str:
        """Why no orders may be sent to this system (two vehicles share its address), "" if they may."""
        faults = (line.twins.fault(system) for line in self._lines.values())
        return next((fault for fault in faults if fault), "") or self._across.fault(system)

    def armed(self, system: int) -> bool:
        """Whether any component of the system reports that it is armed."""
        return any(heard.armed for heard in self._beats() if heard.source[0] == system)

    def beat_age_s(self, source: Source, now_s: float) -> float:
        """Time since its last HEARTBEAT, s; inf if none was heard."""
        heard = self._beat_of(source)
        return float("inf") if heard is None else now_s - heard.time_s

    def silent_s(self, source: Source, now_s: float) -> float:
        """Time since its last frame of any kind, s; inf if it was never heard."""
        return now_s - self._senders.heard_s(source)

    def link_of(self, source: Source) -> str:
        """Name of the link of its last frame, "" if it was never heard."""
        sender = self._senders.get(source)
        return "" if sender is None else sender.link

    def sources(self, now_s: float) -> list[tuple[str, SourceHealth]]:
        """Link name and health of every sender, by system, component and link; without links silent for LINE_GONE_S."""
        healths = [
            (n, health) for n, line in self._lines.items() for health in line.health.snapshot(now_s).sources
        ]
        return sorted(healths, key=lambda one: (one[1].system, one[1].component, one[0]))

    def is_vehicle(self, source: Source) -> bool:
        """Whether the component is an autopilot or a companion computer."""
        heard = self._beat_of(source)
        return heard is not None and heard.is_vehicle

    def _line(self, link: Link, time_s: float) -> _Line:
        """The state of the link on which a frame arrived now; forgets links that have long been silent."""
        line = self._lines.get(link.name)
        if line is None:
            line = self._lines[link.name] = _Line(Twins(link))
        line.heard_s = time_s
        gone = [name for name, known in self._lines.items() if time_s - known.heard_s > LINE_GONE_S]
        for name in gone:
            del self._lines[name]
        return line

    def _beats(self) -> list[Heard]:
        return [sender.heard for _, sender in self._senders.items() if sender.heard is not None]

    def _beat_of(self, source: Source) -> Heard | None:
        sender = self._senders.get(source)
        return None if sender is None else sender.heard

    def _beating(self, now_s: float) -> list[Source]:
        return [
            heard.source for heard in self._beats() if heard.is_vehicle and now_s - heard.time_s <= SILENT_S
        ]
