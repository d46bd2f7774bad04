"""Detection of two vehicles with the same MAVLink address on a link: their messages mix, and both obey orders.

There are three signs, each an alternation that a single vehicle can't show, even if it reboots: UDP peers that take
turns (seen by the link), boot clocks, and runs of sequence numbers. A frame may arrive late, never early: delay alone
never makes the boot clock run back. A reboot does so once, and the old clock is not heard again.
"""

from dataclasses import dataclass
from typing import Final, Protocol

from pymavlink.dialects.v20 import ardupilotmega as dialect

from bridge.framing import Frame, decode
from gcs_plugin.senders import Senders, Source
from gcs_plugin.turns import CLOCK_LATE_S, CLOCK_TURNS, Told, Turns

CLOCK_APART_S: Final = 2.0  # frames of the same vehicle overtake each other by less
SEQUENCE_TURNS: Final = 6
SEQUENCE_NEAR: Final = 32
SEQUENCES: Final = 256
STATIONS: Final = dialect.MAV_TYPE_GCS


class Named(Protocol):
    """The part of a link used here; a link that knows its peers lists the addresses that they share as `contested`."""

    @property
    def name(self) -> str: ...


class _Sequences:
    """Alternation between two runs of sequence numbers, each of which goes on from its last number."""

    def __init__(self, sequence: int) -> None:
        self.turns = Turns(SEQUENCE_TURNS)
        self._current = sequence
        self._left: int | None = None

    def take(self, sequence: int, now_s: float) -> None:
        if (sequence - self._current + SEQUENCE_NEAR) % SEQUENCES > 2 * SEQUENCE_NEAR:
            goes_on = self._left is not None and (sequence - self._left) % SEQUENCES <= SEQUENCE_NEAR
            self.turns.change(goes_on, now_s)
            self._left = self._current
        self._current = sequence


class _Clocks:
    """Alternation between two boot clocks: the boot time runs back, then ahead of the time that passed, and so on."""

    def __init__(self) -> None:
        self.turns = Turns(CLOCK_TURNS)
        self._current: Told | None = None
        self._left: Told | None = None
        self._ran_back: bool | None = None

    def take(self, boot_s: float, now_s: float) -> None:
        reading, last = Told(boot_s, now_s - boot_s), self._current
        self._current = reading
        if last is None:
            return
        back = reading.boot_s < last.boot_s - CLOCK_APART_S
        if not back and reading.booted_s >= last.booted_s - CLOCK_APART_S:
            return
        goes_on = self._left is not None and abs(reading.booted_s - self._left.booted_s) <= CLOCK_LATE_S
        self.turns.change(goes_on and back is not self._ran_back, now_s)
        self._left, self._ran_back = last, back


@dataclass
class _Signs:
    """Signs seen of an address; each is None before its first reading."""

    sequences: _Sequences | None = None
    clocks: _Clocks | None = None
    is_station: bool = False

    def are_two(self, now_s: float) -> bool:
        return any(sign is not None and sign.turns.are_two(now_s) for sign in (self.sequences, self.clocks))


class Twins:
    """Watches the frames of a link for two vehicles that share system and component."""

    def __init__(self, link: Named) -> None:
        self._link = link
        self._now_s = 0.0
        self._signs: Senders[_Signs] = Senders()

    def on_frame(self, frame: Frame, time_s: float) -> None:
        """A frame arrived at `time_s`."""
        if not frame.known:
            return
        self._now_s = time_s
        source = (frame.system, frame.component)
        signs = self._signs.get(source) or _Signs()
        if not self._signs.put(source, time_s, signs):
            return
        signs.sequences = signs.sequences or _Sequences(frame.sequence)
        signs.sequences.take(frame.sequence, time_s)
        if frame.message_id == dialect.MAVLINK_MSG_ID_SYSTEM_TIME:
            message = decode(frame)
            if message is not None:
                signs.clocks = signs.clocks or _Clocks()
                signs.clocks.take(message.time_boot_ms / 1e3, time_s)
        elif frame.message_id == dialect.MAVLINK_MSG_ID_HEARTBEAT:
            message = decode(frame)
            if message is not None and message.type == STATIONS:
                signs.is_station = True

    def fault(self, system: int | None = None) -> str:
        """Why no orders may be sent, "" if they may; of the given system, or of any. Ground stations are ignored."""
        contested: frozenset[Source] = getattr(self._link, "contested", frozenset())
        shared = sorted(
            source
            for source, signs in self._signs.items()
            if not signs.is_station
            and system in (None, source[0])
            and (source in contested or signs.are_two(self._now_s))
        )
        if not shared:
            return ""
        return twins_sentence(self._link.name, shared[0])


def twins_sentence(where: str, source: Source) -> str:
    """Message to the operator about two vehicles with the same address."""
    system, component = source
    return (
        f"{where}: two vehicles beat as system {system}, component {component}, and both would obey; "
        "stop one, or give one another id (system_id in its vehicle file)"
    )
