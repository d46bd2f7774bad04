"""Two vehicles with one MAVLink address on a link: what each says passes for the other's, and both obey.

Three signs, each an alternation that one vehicle, even one that starts anew, can't show: UDP peers that take
turns (the link sees them), boot clocks, and runs of sequence numbers. A frame may arrive late, never early: delay
alone never lets the time since boot run back. A restart does so once, and the old clock is not heard again.
"""

from dataclasses import dataclass
from typing import Final, Protocol

from pymavlink.dialects.v20 import ardupilotmega as dialect

from bridge.framing import Frame, decode
from gcs_plugin.senders import Senders, Source
from gcs_plugin.turns import CLOCK_LATE_S, CLOCK_TURNS, Told, Turns

CLOCK_APART_S: Final = 2.0  # more than frames of one vehicle overtake each other
SEQUENCE_TURNS: Final = 6
SEQUENCE_NEAR: Final = 32
SEQUENCES: Final = 256
STATIONS: Final = dialect.MAV_TYPE_GCS


class Named(Protocol):
    """A link, as far as it matters here; one that sees its peers lists those that share an address as `contested`."""

    @property
    def name(self) -> str: ...


class _Sequences:
    """Two counters of frames, each of which goes on where it was left."""

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
    """Two boot clocks: the time since boot runs back, then ahead of the time that passed, and so on."""

    def __init__(self) -> None:
        self.turns = Turns(CLOCK_TURNS)
        self._current: Told | None = None
        self._left: Told | None = None
        self._ran_back: bool | None = None

    def take(self, boot_s: float, now_s: float) -> None:
        told, last = Told(boot_s, now_s - boot_s), self._current
        self._current = told
        if last is None:
            return
        back = told.boot_s < last.boot_s - CLOCK_APART_S
        if not back and told.booted_s >= last.booted_s - CLOCK_APART_S:
            return
        goes_on = self._left is not None and abs(told.booted_s - self._left.booted_s) <= CLOCK_LATE_S
        self.turns.change(goes_on and back is not self._ran_back, now_s)
        self._left, self._ran_back = last, back


@dataclass
class _Signs:
    """What one address shows; None before it shows any of it."""

    sequences: _Sequences | None = None
    clocks: _Clocks | None = None
    is_station: bool = False

    def are_two(self, now_s: float) -> bool:
        return any(sign is not None and sign.turns.are_two(now_s) for sign in (self.sequences, self.clocks))


class Twins:
    """Watches the frames of one link for two vehicles that share system and component."""

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
        """Why nobody may be ordered, "" where all is well; of one system, or of any that is no ground station."""
        contested: frozenset[Source] = getattr(self._link, "contested", frozenset())
        found = sorted(
            source
            for source, signs in self._signs.items()
            if not signs.is_station
            and system in (None, source[0])
            and (source in contested or signs.are_two(self._now_s))
        )
        if not found:
            return ""
        return twins_sentence(self._link.name, found[0])


def twins_sentence(where: str, source: Source) -> str:
    """What an operator is told of two vehicles under one address."""
    system, component = source
    return (
        f"{where}: two vehicles beat as system {system}, component {component}, and both would obey; "
        "stop one, or give one another id (system_id in its vehicle file)"
    )
