"""Which vehicles beat on the links of a ground, and which of them is meant.

Pure: frames with their time of arrival in, the vehicle that may be ordered out. Where that is not clear it raises,
and nothing is to be sent.
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
"""Without a HEARTBEAT for so long a vehicle is not there: at 30 % loss of one a second, once in a thousand."""

LINE_GONE_S: Final = 300.0
"""A link that carried nothing for so long, while others did, is told of no more."""

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
    """A message that parameters may wait for; `rebooted`: it tells that its sender has started anew."""

    source: Source
    message: Any
    rebooted: bool = False


@dataclass
class _Line:
    """One link, what it carries and who shares addresses on it; `heard_s` is when it last carried anything."""

    twins: Twins
    health: LinkHealth = field(default_factory=LinkHealth)
    heard_s: float = 0.0


@dataclass
class _Sender:
    """What is known of one component: the link that last carried it, its last HEARTBEAT, its time since boot."""

    link: str
    heard: Heard | None = None
    boot_ms: int | None = None


class Fleet:
    """Everybody who is heard on any link. `choose` names the system that is meant, None the only one."""

    def __init__(self) -> None:
        self.chosen: int | None = None
        self._lines: dict[str, _Line] = {}
        self._senders: Senders[_Sender] = Senders()
        self._since_s: dict[int, float] = {}
        self._across = TwinsAcross()

    def on_frame(self, frame: Frame, link: Link, time_s: float) -> News | None:
        """A frame arrived on `link`; what parameters may wait for, None where it has no use for them."""
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
        """Mean one system, or with None whichever is alone. Raises LinkError for one that does not beat."""
        if system is not None and system not in self.systems(now_s):
            there = ", ".join(map(str, self.systems(now_s))) or "none"
            raise LinkError(f"no vehicle beats as system {system}; these do: {there}")
        self.chosen = system
        return None if system is None else self.meant(now_s)

    def systems(self, now_s: float) -> tuple[int, ...]:
        """The systems of the vehicles that beat."""
        return tuple(sorted({source[0] for source in self._beating(now_s)}))

    def meant(self, now_s: float) -> Source:
        """The component that keeps the parameters of the vehicle that is meant: a companion before an autopilot.

        Raises LinkTimeout where none beats, LinkError where several do and none is chosen, where two share an
        address, and where one was heard only just now, so that a companion may yet follow.
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
        found = [source for source in self._beating(now_s) if source[0] == systems[0]]
        return min(found, key=lambda source: (source[1] not in COMPANIONS, source[1]))

    def fault(self, system: int) -> str:
        """Why nobody may order this system, "" where all is well."""
        faults = (line.twins.fault(system) for line in self._lines.values())
        return next((fault for fault in faults if fault), "") or self._across.fault(system)

    def armed(self, system: int) -> bool:
        """Whether any part of it says that it is armed."""
        return any(heard.armed for heard in self._beats() if heard.source[0] == system)

    def beat_age_s(self, source: Source, now_s: float) -> float:
        """Since when it has not beaten."""
        heard = self._beat_of(source)
        return float("inf") if heard is None else now_s - heard.time_s

    def silent_s(self, source: Source, now_s: float) -> float:
        """Since when nothing at all came from it."""
        return now_s - self._senders.heard_s(source)

    def link_of(self, source: Source) -> str:
        """The name of the link that last carried it, "" for one who was never heard."""
        sender = self._senders.get(source)
        return "" if sender is None else sender.link

    def sources(self, now_s: float) -> list[tuple[str, SourceHealth]]:
        """Link and health of everybody who was heard on links that carry anything, by system and component."""
        found = [
            (n, health) for n, line in self._lines.items() for health in line.health.snapshot(now_s).sources
        ]
        return sorted(found, key=lambda one: (one[1].system, one[1].component, one[0]))

    def is_vehicle(self, source: Source) -> bool:
        """Whether it is an autopilot or a companion computer."""
        heard = self._beat_of(source)
        return heard is not None and heard.is_vehicle

    def _line(self, link: Link, time_s: float) -> _Line:
        """The link on which something came now; those that are long gone are forgotten."""
        line = self._lines.get(link.name)
        if line is None:
            line = self._lines[link.name] = _Line(Twins(link))
        line.heard_s = time_s
        gone = [name for name, one in self._lines.items() if time_s - one.heard_s > LINE_GONE_S]
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
