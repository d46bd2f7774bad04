"""The senders on the links of the ground: a single table of MAVLink components for all of the program.

It answers, each by one rule: is it a vehicle, when was it heard and on which link, how many of its frames were lost,
has it rebooted, do two vehicles share its address, and must it be sent an OFF. Pure: frames and times go in. Two
vehicles under one address show in the turns of UDP peers (the link sees those) and in those of `sequences`.
"""

import math
import struct
from collections import Counter
from collections.abc import Collection, Iterable, Iterator
from dataclasses import dataclass, field
from typing import Final

from pymavlink.dialects.v20 import ardupilotmega as dialect

from bridge.errors import LinkError
from bridge.firmware.description import Firmware
from bridge.firmware.table import firmware_of
from bridge.links.link import Link
from bridge.vehicle.parameters import MODE
from bridge.wire.framing import Frame
from bridge.wire.readings import Values
from gcs_plugin.sequences import BootClock, BootReading, OnLink

Source = tuple[int, int]
"""System and component."""

GROUND_STATION: Final[Source] = (255, 190)
"""The ground's own address."""

MOST_PEERS: Final = 256  # far more components than any fleet has
GONE_S: Final = 60.0
"""In a full table, a component that was silent for longer gives its place to a new one; one that speaks never does."""


COMPANIONS: Final = range(dialect.MAV_COMP_ID_ONBOARD_COMPUTER, dialect.MAV_COMP_ID_ONBOARD_COMPUTER4 + 1)
COMPANIONS_MAY_FOLLOW_S: Final = 1.5
"""After the first HEARTBEAT of a vehicle, the time within which that of a companion computer comes."""

KNOWN_FOR_S: Final = 3600.0
"""Time for which a vehicle that reported FF_MODE is still sent OFF: a dive out of range is shorter."""
PASSED_BY_S: Final = 60.0
"""The same for a vehicle that only sent HEARTBEATs: it may have no feed-forward, or belong to a boat that passed by."""

CROWDED: Final = "more senders than any fleet has, so somebody makes up addresses"

_HEARTBEAT: Final[int] = dialect.MAVLINK_MSG_ID_HEARTBEAT
_SYSTEM_TIME: Final[int] = dialect.MAVLINK_MSG_ID_SYSTEM_TIME
_NAME_BYTES: Final = {dialect.MAVLINK_MSG_ID_PARAM_VALUE: 16, dialect.MAVLINK_MSG_ID_NAMED_VALUE_FLOAT: 10}
"""Length of the name in the messages that may report FF_MODE; it stands at byte 8 of both."""
NAME_AT: Final = 8
_MODE: Final = MODE.encode()
_HEARTBEAT_BYTES: Final = 9
_CLOCK: Final = struct.Struct("<QI")
"""SYSTEM_TIME on the wire: Unix time in us, time since boot in ms."""
_FAILSAFE: Final = frozenset(
    (dialect.MAV_STATE_CRITICAL, dialect.MAV_STATE_EMERGENCY, dialect.MAV_STATE_FLIGHT_TERMINATION)
)


def parameter_holder(components: Iterable[Source]) -> Source:
    """The component of a vehicle that holds its parameters: a companion computer before an autopilot."""
    return min(components, key=lambda source: (source[1] not in COMPANIONS, source[1]))


def ground_heartbeat() -> dialect.MAVLink_heartbeat_message:
    return dialect.MAVLink_heartbeat_message(
        dialect.MAV_TYPE_GCS, dialect.MAV_AUTOPILOT_INVALID, 0, 0, dialect.MAV_STATE_ACTIVE, 3
    )


@dataclass(frozen=True, slots=True)
class Heartbeat:
    """A HEARTBEAT: its MAV_TYPE, MAV_AUTOPILOT, base mode and MAV_STATE, and when it arrived."""

    kind: int
    autopilot: int
    mode: int
    state: int
    time_s: float

    @property
    def is_station(self) -> bool:
        return self.kind == int(dialect.MAV_TYPE_GCS)

    @property
    def is_autopilot(self) -> bool:
        """Whether it commands thrusters by itself, as an autopilot or a vehicle without one does."""
        return not self.is_station and self.autopilot != int(dialect.MAV_AUTOPILOT_INVALID)

    @property
    def is_vehicle(self) -> bool:
        """Whether it is part of a vehicle that takes orders: an autopilot or a companion computer. A camera is not."""
        return self.is_autopilot or self.kind == int(dialect.MAV_TYPE_ONBOARD_CONTROLLER)

    @property
    def firmware(self) -> Firmware | None:
        """The autopilot's firmware, None for one that is not supported, or none."""
        return firmware_of(self.autopilot)

    @property
    def serves_unheard(self) -> bool:
        """Whether it executes orders to a component that it has not heard, such as its companion."""
        return self.firmware is not None and self.firmware.serves_unheard

    @property
    def armed(self) -> bool:
        return bool(self.mode & dialect.MAV_MODE_FLAG_SAFETY_ARMED) and not self.is_station

    @property
    def in_failsafe(self) -> bool:
        """Whether it calls its own state critical, an emergency, or the end."""
        return self.state in _FAILSAFE


def heartbeat_of(frame: Frame, time_s: float) -> Heartbeat:
    """Decode a HEARTBEAT, on the wire custom_mode (4 bytes), type, autopilot, base_mode, system_status."""
    kind, autopilot, mode, state = frame.payload.ljust(_HEARTBEAT_BYTES, b"\0")[4:8]
    return Heartbeat(kind, autopilot, mode, state, time_s)


def heartbeat_read(values: Values, time_s: float) -> Heartbeat:
    """The HEARTBEAT of an `alive` reading: of its mode, whether it is armed, and of its state nothing."""
    armed, kind, autopilot = values
    mode = dialect.MAV_MODE_FLAG_SAFETY_ARMED if armed else 0
    return Heartbeat(int(kind), int(autopilot), mode, 0, time_s)


def of_commanders(beats: Iterable[Heartbeat]) -> list[Heartbeat]:
    """The HEARTBEATs that say whether a vehicle is armed: an autopilot's, a companion's only without any of one."""
    of_vehicle = [beat for beat in beats if beat.is_vehicle]
    return [beat for beat in of_vehicle if beat.is_autopilot] or of_vehicle


@dataclass(frozen=True, slots=True)
class Reception:
    """Frames received of a component on a link, and frames lost by its sequence numbers; routers can falsify `lost`.

    `tells_loss` is False for a ground station and a companion: what they say to the autopilot alone goes no further,
    and leaves gaps in the numbers that are no losses.
    """

    system: int
    component: int
    received: int
    lost: int
    age_s: float
    tells_loss: bool

    @property
    def loss(self) -> float:
        """Fraction of the component's frames that did not arrive here."""
        return self.lost / max(self.received + self.lost, 1)


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
        minutes, seconds = divmod(int(unix_s) % 86_400, 60) if math.isfinite(unix_s) else (0, 0)
        at = f" at {minutes // 60:02d}:{minutes % 60:02d}:{seconds:02d} UTC" if math.isfinite(unix_s) else ""
        return f"{who} started anew{at} (its clock went back to {self.boot_s:.0f} s)"


@dataclass(frozen=True, slots=True)
class KnownVehicle:
    """Component of a vehicle; `holds`: it has reported FF_MODE; `heard_s`: time of its last HEARTBEAT or FF_MODE;
    `behind`: a companion behind an autopilot that executes the orders to a companion that it has not heard."""

    source: Source
    holds: bool
    heard_s: float
    behind: bool = False

    def is_known(self, now_s: float) -> bool:
        """Whether it was heard recently enough to be sent OFF."""
        return now_s - self.heard_s <= (KNOWN_FOR_S if self.holds else PASSED_BY_S)


def newest(vehicles: Iterable[KnownVehicle]) -> tuple[KnownVehicle, ...]:
    """The newest entry of each source."""
    in_order = sorted(vehicles, key=lambda vehicle: vehicle.heard_s)
    return tuple({vehicle.source: vehicle for vehicle in in_order}.values())


@dataclass(slots=True)
class Peer:
    """A component that speaks: when and on which link it was last heard, and its last HEARTBEAT.

    `rebooted`: its last frame carried a boot time that had run back; `restart`: its last frame confirmed a reboot.
    `vehicle_s` is the time of its first HEARTBEAT as a vehicle, inf before; `mode_s` that of its last FF_MODE.
    """

    source: Source
    link: str
    heard_s: float
    heartbeat: Heartbeat | None = None
    rebooted: bool = False
    restart: Restart | None = None
    vehicle_s: float = math.inf
    mode_s: float = -math.inf
    links: dict[str, OnLink] = field(default_factory=dict)
    clock: BootClock | None = None

    @property
    def is_vehicle(self) -> bool:
        return self.heartbeat is not None and self.heartbeat.is_vehicle

    @property
    def is_station(self) -> bool:
        return self.heartbeat is not None and self.heartbeat.is_station

    @property
    def tells_loss(self) -> bool:
        """Whether gaps in its sequence numbers are losses (`Reception`)."""
        return not self.is_station and self.source[1] not in COMPANIONS

    def beats(self, now_s: float, within_s: float) -> bool:
        """Whether it sent a HEARTBEAT within that time."""
        return self.heartbeat is not None and now_s - self.heartbeat.time_s <= within_s

    def hear(self, frame: Frame, link: str, time_s: float) -> None:
        self.link, self.heard_s, self.rebooted, self.restart = link, time_s, False, None
        here = self.links.get(link)
        if here is None:
            here = self.links[link] = OnLink(frame.sequence, time_s, run=frame.sequence)
        else:
            here.hear(frame.sequence, time_s)
        number = frame.message_id
        if number == _HEARTBEAT:
            self.heartbeat, here.beat_s = heartbeat_of(frame, time_s), time_s
            if self.is_vehicle:
                self.vehicle_s = min(self.vehicle_s, time_s)
        elif number == _SYSTEM_TIME:
            self._hear_clock(frame, here, time_s)
        elif number in _NAME_BYTES and _MODE in frame.payload:
            name = frame.payload[NAME_AT : NAME_AT + _NAME_BYTES[number]]
            if name.rstrip(b"\0") == _MODE:
                self.mode_s = time_s

    def _hear_clock(self, frame: Frame, here: OnLink, time_s: float) -> None:
        unix_us, boot_ms = _CLOCK.unpack_from(frame.payload.ljust(_CLOCK.size, b"\0"))
        boot_s = boot_ms / 1e3
        if self.clock is not None:
            boot_s = self.clock.unwrapped(boot_s, time_s)
        self.rebooted = here.hear_clock(boot_s, frame.sequence)
        now = BootReading(boot_s, time_s - boot_s, unix_us / 1e6 - boot_s if unix_us else math.nan, self.link)
        if self.clock is None:
            self.clock = BootClock(now, now, current=now)
            return
        first = self.clock.hear(now, time_s)
        if first is not None and self.is_vehicle:
            self.restart = Restart(self.source, first.booted_s, first.boot_s)

    def shared_on(self, now_s: float, contested: frozenset[Source]) -> str:
        """Name of the links on which two vehicles speak under this address; "" if it is one vehicle."""
        for name, here in self.links.items():
            if self.source in contested or here.runs.is_seen(now_s):
                return name
        clock = self.clock
        if clock is None or not clock.turns.is_seen(now_s) or clock.current is None or clock.left is None:
            return ""
        return " and ".join(sorted({clock.current.link, clock.left.link}))


class Peers:
    """The table, of at most MOST_PEERS components. `link`, if given, is asked which addresses its peers share.

    Only frames with a verified checksum count: a frame with an unknown id proves nothing. A component that speaks keeps
    its place, so that made-up addresses neither fill the memory nor displace a vehicle; frames of those that find no
    place are counted in `left_out`, by link.
    """

    def __init__(self, link: Link | None = None) -> None:
        self._link = link
        self._now_s = 0.0
        self._peers: dict[Source, Peer] = {}
        self._full_until_s = -math.inf
        self.left_out: Counter[str] = Counter()

    def on_frame(self, frame: Frame, link: str, time_s: float) -> Peer | None:
        """A frame arrived on the link of that name; return its sender, None if it has no place or proves nothing."""
        if not frame.known:
            return None
        source = (frame.system, frame.component)
        peer = self._peers.get(source)
        if peer is None:
            if len(self._peers) >= MOST_PEERS and not self._let_go(time_s):
                self.left_out[link] += 1
                return None
            peer = self._peers[source] = Peer(source, link, time_s)
        self._now_s = time_s
        peer.hear(frame, link, time_s)
        return peer

    def get(self, source: Source) -> Peer | None:
        """A component, None if it has no place in the table."""
        return self._peers.get(source)

    def __iter__(self) -> Iterator[Peer]:
        return iter(list(self._peers.values()))

    def vehicles(self, now_s: float, within_s: float = math.inf) -> list[Peer]:
        """The components of vehicles that sent a HEARTBEAT within that time."""
        return [peer for peer in self._peers.values() if peer.is_vehicle and peer.beats(now_s, within_s)]

    def companion_follows(self, system: int | None) -> bool:
        """Whether a companion of the system, of any for None, speaks that has not beaten yet."""
        return any(
            peer.source[1] in COMPANIONS and peer.heartbeat is None
            for peer in self._peers.values()
            if system in (None, peer.source[0])
        )

    def only_vehicle(self, components: Collection[Source], how_to_choose: str) -> Source:
        """The component that holds the parameters of the only vehicle among these components.

        Raises LinkError if they are of several vehicles, with `how_to_choose` one, or if two share its address.
        """
        systems = sorted({system for system, _ in components})
        if len(systems) > 1:
            raise LinkError(
                f"several vehicles beat (systems {', '.join(map(str, systems))}) and none is chosen; {how_to_choose}"
            )
        if fault := self.fault(systems[0]):
            raise LinkError(fault)
        return parameter_holder(components)

    def armed(self, system: int) -> bool:
        """Whether any component of the system reports that it is armed."""
        return any(
            peer.heartbeat.armed
            for peer in self._peers.values()
            if peer.source[0] == system and peer.heartbeat is not None
        )

    def receptions(self, link: str, now_s: float) -> list[Reception]:
        """Frames received and lost on a link, by address."""
        return [
            Reception(*source, here.received, here.lost, now_s - here.last_s, peer.tells_loss)
            for source, peer in sorted(self._peers.items())
            if (here := peer.links.get(link)) is not None
        ]

    def lost(self) -> int:
        """Number of frames lost on any link, of those that tell a loss (`Reception`)."""
        peers = [peer for peer in self._peers.values() if peer.tells_loss]
        return sum(here.lost for peer in peers for here in peer.links.values())

    def known(self, now_s: float) -> tuple[KnownVehicle, ...]:
        """The vehicles that an OFF must go to, also if they are out of range now."""
        vehicles = []
        fronts = {p.source[0] for p in self._peers.values() if p.heartbeat and p.heartbeat.serves_unheard}
        for peer in self._peers.values():
            beat_s = peer.heartbeat.time_s if peer.heartbeat is not None and peer.is_vehicle else -math.inf
            behind = peer.source[1] in COMPANIONS and peer.source[0] in fronts
            vehicle = KnownVehicle(peer.source, peer.mode_s > -math.inf, max(beat_s, peer.mode_s), behind)
            if vehicle.heard_s > -math.inf and vehicle.is_known(now_s):
                vehicles.append(vehicle)
        return tuple(vehicles)

    def fault(self, system: int | None = None) -> str:
        """Why no orders may be sent to a system, or to any (two vehicles share its address); "" if they may."""
        contested = self._link.contested if self._link is not None else frozenset()
        for source, peer in sorted(self._peers.items()):
            if peer.is_station or system not in (None, source[0]):
                continue
            if where := peer.shared_on(self._now_s, contested):
                return (
                    f"{where}: two vehicles beat as system {source[0]}, component {source[1]}, and both would obey; "
                    "stop one, or give one another id (system_id in its vehicle file)"
                )
        return ""

    def _let_go(self, time_s: float) -> bool:
        """Remove the component that was silent longest, if for more than GONE_S; return whether one was removed."""
        if time_s <= self._full_until_s:
            return False
        longest = min(self._peers.values(), key=lambda peer: peer.heard_s)
        if time_s - longest.heard_s <= GONE_S:
            self._full_until_s = longest.heard_s + GONE_S
            return False
        del self._peers[longest.source]
        return True
