"""Two vehicles with one MAVLink address on a link: what each says passes for the other's, and both obey.

Three signs, each an alternation that one vehicle, even one that starts anew, can't show: UDP peers that take
turns (the link sees them), boot clocks, and runs of sequence numbers.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Final, Protocol

from pymavlink.dialects.v20 import ardupilotmega as dialect

from bridge.framing import Frame, decode

CLOCK_TURNS: Final = 3
CLOCK_NEAR_S: Final = 0.5
SEQUENCE_TURNS: Final = 6
SEQUENCE_NEAR: Final = 32
SEQUENCES: Final = 256
FORGOTTEN_AFTER: Final = 512  # values in one run: what took turns before has ended
STATIONS: Final = dialect.MAV_TYPE_GCS


class Named(Protocol):
    """A link, as far as it matters here; one that sees its peers lists those that share an address as `contested`."""

    @property
    def name(self) -> str: ...


@dataclass
class _Turns:
    """Two runs of values of which each goes on where it was left: `turns` counts the changes between them."""

    near: Callable[[float, float], bool]
    current: float
    other: float | None = None
    turns: int = 0
    since: int = 0

    def take(self, value: float) -> None:
        self.since += 1
        if self.near(value, self.current):
            self.current = value
            if self.since > FORGOTTEN_AFTER:
                self.other, self.turns = None, 0
            return
        known = self.other is not None and self.near(value, self.other)
        self.turns = self.turns + 1 if known else 0
        self.current, self.other, self.since = value, self.current, 0


def _sequence_near(value: float, last: float) -> bool:
    return (value - last + SEQUENCE_NEAR) % SEQUENCES <= 2 * SEQUENCE_NEAR


def _clock_near(value: float, last: float) -> bool:
    return abs(value - last) <= CLOCK_NEAR_S


class Twins:
    """Watches the frames of one link for two vehicles that share system and component."""

    def __init__(self, link: Named) -> None:
        self._link = link
        self._sequences: dict[tuple[int, int], _Turns] = {}
        self._clocks: dict[tuple[int, int], _Turns] = {}
        self._stations: set[tuple[int, int]] = set()

    def on_frame(self, frame: Frame, time_s: float) -> None:
        """A frame arrived at `time_s`."""
        if not frame.known:
            return
        source = (frame.system, frame.component)
        self._sequences.setdefault(source, _Turns(_sequence_near, frame.sequence)).take(frame.sequence)
        if frame.message_id == dialect.MAVLINK_MSG_ID_SYSTEM_TIME:
            message = decode(frame)
            if message is not None:
                booted_s = time_s - message.time_boot_ms / 1e3
                self._clocks.setdefault(source, _Turns(_clock_near, booted_s)).take(booted_s)
        elif frame.message_id == dialect.MAVLINK_MSG_ID_HEARTBEAT:
            message = decode(frame)
            if message is not None and message.type == STATIONS:
                self._stations.add(source)

    def fault(self, system: int | None = None) -> str:
        """Why nobody may be ordered, "" where all is well; of one system, or of any that is no ground station."""
        contested = set(getattr(self._link, "contested", ()))
        contested |= {source for source, t in self._sequences.items() if t.turns >= SEQUENCE_TURNS}
        contested |= {source for source, t in self._clocks.items() if t.turns >= CLOCK_TURNS}
        found = sorted(
            source
            for source in contested - self._stations
            if source in self._sequences and system in (None, source[0])
        )
        if not found:
            return ""
        number, component = found[0]
        return (
            f"{self._link.name}: two vehicles beat as system {number}, component {component}, and both would obey; "
            "stop one, or give one another id (system_id in its vehicle file)"
        )
