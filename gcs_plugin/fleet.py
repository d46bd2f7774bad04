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
from gcs_plugin.twins import Twins

SILENT_S: Final = 6.0
"""Without a HEARTBEAT for so long a vehicle is not there: at 30 % loss of one a second, once in a thousand."""

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
    """One link, what it carries and who shares addresses on it."""

    twins: Twins
    health: LinkHealth = field(default_factory=LinkHealth)


class Fleet:
    """Everybody who is heard on any link. `choose` names the system that is meant, None the only one."""

    def __init__(self) -> None:
        self.chosen: int | None = None
        self._lines: dict[str, _Line] = {}
        self._heard: dict[Source, Heard] = {}
        self._since_s: dict[int, float] = {}
        self._boot_ms: dict[Source, int] = {}
        self._frame_s: dict[Source, float] = {}
        self._link: dict[Source, str] = {}

    def on_frame(self, frame: Frame, link: Link, time_s: float) -> News | None:
        """A frame arrived on `link`; what parameters may wait for, None where it has no use for them."""
        line = self._lines.setdefault(link.name, _Line(Twins(link)))
        line.health.on_frame(frame, time_s)
        line.twins.on_frame(frame, time_s)
        source = (frame.system, frame.component)
        if frame.known:
            self._frame_s[source], self._link[source] = time_s, link.name
        message = decode(frame) if frame.message_id in _USED else None
        if message is None:
            return None
        if frame.message_id == dialect.MAVLINK_MSG_ID_HEARTBEAT:
            is_station = message.type == dialect.MAV_TYPE_GCS
            armed = bool(message.base_mode & dialect.MAV_MODE_FLAG_SAFETY_ARMED) and not is_station
            self._heard[source] = Heard(source, message.type, message.autopilot, armed, time_s)
            self._since_s.setdefault(frame.system, time_s)
        elif frame.message_id == dialect.MAVLINK_MSG_ID_SYSTEM_TIME:
            before, self._boot_ms[source] = self._boot_ms.get(source), message.time_boot_ms
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
                    f"vehicle {self.chosen} has not beaten for {SILENT_S:.0f} s; check its link, or choose another"
                )
            systems = (self.chosen,)
        if not systems:
            raise LinkTimeout("no vehicle beats on any link; check cable, address, and that the bridge runs")
        if len(systems) > 1:
            raise LinkError(
                f"several vehicles beat (systems {', '.join(map(str, systems))}) and none is chosen; choose one first"
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
        return next((fault for fault in faults if fault), "")

    def armed(self, system: int) -> bool:
        """Whether any part of it says that it is armed."""
        return any(heard.armed for source, heard in self._heard.items() if source[0] == system)

    def beat_age_s(self, source: Source, now_s: float) -> float:
        """Since when it has not beaten."""
        heard = self._heard.get(source)
        return float("inf") if heard is None else now_s - heard.time_s

    def silent_s(self, source: Source, now_s: float) -> float:
        """Since when nothing at all came from it."""
        return now_s - self._frame_s.get(source, float("-inf"))

    def link_of(self, source: Source) -> str:
        """The name of the link that last carried it."""
        return self._link[source]

    def sources(self, now_s: float) -> list[tuple[str, SourceHealth]]:
        """Link and health of everybody who was ever heard, by system and component."""
        found = [
            (n, health) for n, line in self._lines.items() for health in line.health.snapshot(now_s).sources
        ]
        return sorted(found, key=lambda one: (one[1].system, one[1].component, one[0]))

    def is_vehicle(self, source: Source) -> bool:
        """Whether it is an autopilot or a companion computer."""
        return source in self._heard and self._heard[source].is_vehicle

    def _beating(self, now_s: float) -> list[Source]:
        return [
            source
            for source, heard in self._heard.items()
            if heard.is_vehicle and now_s - heard.time_s <= SILENT_S
        ]
