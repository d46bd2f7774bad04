"""The senders on a link: heartbeats, loss and rate of each over the last seconds, and two under one address."""

import math
from collections import deque
from dataclasses import dataclass
from typing import Final

from pymavlink.dialects.v20 import ardupilotmega as dialect

from bridge.framing import Frame
from gcs_plugin.link_health import LinkHealth
from gcs_plugin.senders import Senders, Source
from gcs_plugin.station import GROUND_STATION
from gcs_plugin.twins import Twins
from gcs_plugin.watch.picture import Armed, LinkRow

LOST_S: Final = 3.0
OVER_S: Final = 10.0
EVERY_S: Final = 1.0
_NO_AUTOPILOT: Final[int] = dialect.MAV_AUTOPILOT_INVALID
_STATION_KIND: Final[int] = dialect.MAV_TYPE_GCS
_COMPANION_KIND: Final[int] = dialect.MAV_TYPE_ONBOARD_CONTROLLER
_ARDUPILOT: Final[int] = dialect.MAV_AUTOPILOT_ARDUPILOTMEGA
_FAILSAFE: Final = frozenset((dialect.MAV_STATE_CRITICAL, dialect.MAV_STATE_EMERGENCY))
_HEARTBEAT_BYTES: Final = 9

Counts = dict[Source, tuple[int, int]]


@dataclass(frozen=True, slots=True)
class Beat:
    """A HEARTBEAT."""

    kind: int
    autopilot: int
    armed: Armed
    time_s: float

    @property
    def is_station(self) -> bool:
        return self.kind == _STATION_KIND

    @property
    def is_autopilot(self) -> bool:
        """Whether it commands thrusters by itself, as an autopilot or a vehicle without one does."""
        return not self.is_station and self.autopilot != _NO_AUTOPILOT

    @property
    def is_vehicle(self) -> bool:
        return self.is_autopilot or self.kind == _COMPANION_KIND

    @property
    def is_ardupilot(self) -> bool:
        return self.autopilot == _ARDUPILOT


def beat_of(frame: Frame, time_s: float) -> Beat:
    """Decode a HEARTBEAT, on the wire custom_mode (4 bytes), type, autopilot, base_mode, system_status."""
    payload = frame.payload.ljust(_HEARTBEAT_BYTES, b"\0")
    kind, autopilot, mode, status = payload[4:8]
    if status in _FAILSAFE:
        armed = Armed.FAILSAFE
    else:
        armed = Armed.ARMED if mode & dialect.MAV_MODE_FLAG_SAFETY_ARMED else Armed.DISARMED
    return Beat(kind, autopilot, armed, time_s)


class WatchedLink:
    """A link, from its first frame on."""

    def __init__(self, name: str) -> None:
        self.name = name
        self._beats: Senders[Beat] = Senders()
        self._health = LinkHealth()
        self._twins = Twins(self)
        self._counts: deque[tuple[float, Counts]] = deque()
        self._count_due_s = -math.inf

    def on_frame(self, frame: Frame, time_s: float) -> None:
        if time_s >= self._count_due_s:
            self._count(time_s)
        self._health.on_frame(frame, time_s)
        self._twins.on_frame(frame, time_s)

    def beat(self, source: Source, beat: Beat) -> None:
        """Note the heartbeat of a sender."""
        self._beats.put(source, beat.time_s, beat)

    def twins(self, system: int | None) -> str:
        return self._twins.fault(system)

    def rows(self, now_s: float) -> list[LinkRow]:
        """Rows of all senders of heartbeats except ground stations; if there are none, of all other senders."""
        counts = self._now()
        beats = dict(self._beats.items())
        senders = [source for source, beat in beats.items() if not beat.is_station]
        if not senders:
            senders = [s for s in counts if s != GROUND_STATION and s not in beats]
        return [self._row(source, counts.get(source, (0, 0)), now_s) for source in senders]

    def _row(self, source: Source, now: tuple[int, int], now_s: float) -> LinkRow:
        then_s, before = self._base(now_s)
        # A sender that was dropped from the list and came back counts from zero again.
        received, lost = (max(a - b, 0) for a, b in zip(now, before.get(source, (0, 0)), strict=True))
        beat = self._beats.get(source)
        age_s = math.inf if beat is None else now_s - beat.time_s
        loss = lost / (received + lost) if received + lost else 0.0
        rate_hz = received / (now_s - then_s) if now_s > then_s else 0.0
        return LinkRow(self.name, *source, age_s, loss, rate_hz, age_s > LOST_S)

    def _base(self, now_s: float) -> tuple[float, Counts]:
        """The oldest counts of the last seconds; the newest of all if the link has been silent since."""
        recent = (item for item in self._counts if now_s - item[0] <= OVER_S)
        return next(recent, self._counts[-1])

    def _now(self) -> Counts:
        return {(s.system, s.component): (s.received, s.lost) for s in self._health.snapshot(0.0).sources}

    def _count(self, time_s: float) -> None:
        self._count_due_s = time_s + EVERY_S
        self._counts.append((time_s, self._now()))
        while time_s - self._counts[0][0] > OVER_S:
            self._counts.popleft()
