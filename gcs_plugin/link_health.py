"""Health of a link as seen at this end: loss by sequence number, age and rate of each message."""

import struct
from collections import deque
from dataclasses import dataclass, field
from typing import Final

from pymavlink.dialects.v20 import ardupilotmega as dialect

from bridge.framing import Frame
from gcs_plugin.senders import Senders
from gcs_plugin.twins import CLOCK_APART_S

SEQUENCES: Final = 256
LATE: Final = 128  # a gap that wide is a frame that arrived late, not half a cycle of lost frames
RESTART_S: Final = 5.0  # after such a silence the sequence numbers may have started again
RATE_WINDOW: Final = 20
PLACED_EVERY_S: Final = 1.0  # at each frame it would add half of the cost of all the rest here
MOST_KINDS: Final = 4096  # kinds of messages of all senders: some 5 MB
_BOOT_MS: Final = struct.Struct("<I")
_BOOT_MS_AT, _SYSTEM_TIME_BYTES = 8, 12  # behind the Unix time
CROWDED: Final = "more senders or kinds of messages than any fleet has, so somebody makes up addresses"


@dataclass(frozen=True, slots=True)
class SourceHealth:
    """Frames received from a component and frames lost; routers can falsify `lost`."""

    system: int
    component: int
    received: int
    lost: int
    age_s: float

    @property
    def loss(self) -> float:
        """Fraction of the component's frames that did not arrive here."""
        return self.lost / max(self.received + self.lost, 1)


@dataclass(frozen=True, slots=True)
class MessageHealth:
    """Count, age and rate of a kind of message from a component; `rate_hz` is 0 before the second message."""

    system: int
    component: int
    message_id: int
    count: int
    age_s: float
    rate_hz: float


@dataclass(frozen=True)
class Health:
    """Health of a link at an instant; `left_out` counts the frames of senders and kinds that found no place."""

    sources: tuple[SourceHealth, ...]
    messages: tuple[MessageHealth, ...]
    left_out: int = 0

    def age_s(self, message_id: int) -> float:
        """Age of the newest message of a kind from any sender, s; inf if none arrived."""
        return min((m.age_s for m in self.messages if m.message_id == message_id), default=float("inf"))


@dataclass(slots=True)
class _Message:
    count: int = 0
    times_s: deque[float] = field(default_factory=lambda: deque(maxlen=RATE_WINDOW))


@dataclass(slots=True)
class _Source:
    sequence: int
    last_s: float
    placed_s: float
    received: int = 1
    lost: int = 0
    boot_ms: int | None = None
    lost_by_then: int = 0
    messages: dict[int, _Message] = field(default_factory=dict)


class LinkHealth:
    """Counts of a link. Only frames with a verified checksum count: a frame with an unknown id proves nothing.

    An active sender keeps its place in the table, so that made-up addresses neither fill the memory nor displace the
    vehicle. When the table is full, a sender that has long been silent gives up its place and its counts to a new
    sender. Frames of senders without a place are counted in `left_out`.
    """

    def __init__(self) -> None:
        self.left_out = 0
        self._sources: Senders[_Source] = Senders()
        self._kinds = 0

    def on_frame(self, frame: Frame, time_s: float) -> None:
        if not frame.known:
            return
        key = (frame.system, frame.component)
        source = self._sources.get(key)
        if source is None:
            source = _Source(frame.sequence, time_s, time_s)
            if not self._sources.put(key, time_s, source):
                self.left_out += 1
                return
            self._count_kinds()
        else:
            # The time runs back when a replay is set back: refresh the sender's place then too.
            if not 0.0 <= time_s - source.placed_s < PLACED_EVERY_S:
                self._sources.put(key, time_s, source)
                source.placed_s = time_s
            self._count(source, frame.sequence, time_s)
        if frame.message_id == dialect.MAVLINK_MSG_ID_SYSTEM_TIME:
            self._hear_clock(source, frame)
        message = source.messages.get(frame.message_id)
        if message is None:
            if not self._has_place(time_s):
                self.left_out += 1
                return
            message = source.messages[frame.message_id] = _Message()
            self._kinds += 1
        message.count += 1
        message.times_s.append(time_s)

    def snapshot(self, now_s: float) -> Health:
        """Health of all senders in the table, by address."""
        kept = sorted(self._sources.items(), key=lambda one: one[0])
        sources = [SourceHealth(*key, s.received, s.lost, now_s - s.last_s) for key, s in kept]
        messages = [
            MessageHealth(*key, number, m.count, now_s - m.times_s[-1], _rate_hz(m.times_s))
            for key, s in kept
            for number, m in s.messages.items()
        ]
        return Health(tuple(sources), tuple(messages), self.left_out)

    def _has_place(self, time_s: float) -> bool:
        """Whether another kind of message has a place; forgets senders that are gone if needed."""
        while self._kinds >= MOST_KINDS:
            if not self._sources.let_go(time_s):
                return False
            self._count_kinds()
        return True

    def _count_kinds(self) -> None:
        self._kinds = sum(len(source.messages) for _, source in self._sources.items())

    @staticmethod
    def _count(source: _Source, sequence: int, time_s: float) -> None:
        gap = (sequence - source.sequence - 1) % SEQUENCES
        silent_s, source.last_s = time_s - source.last_s, time_s
        if silent_s > RESTART_S:
            gap = 0
        if gap == SEQUENCES - 1:
            return
        source.received += 1
        if gap >= LATE:
            source.lost = max(0, source.lost - 1)
            return
        source.lost += gap
        source.sequence = sequence

    @staticmethod
    def _hear_clock(source: _Source, frame: Frame) -> None:
        """Undo the loss counted since the sender's last boot time if its clock ran back.

        A sender that rebooted starts its sequence numbers again, so the frames that seemed lost since then were not.
        """
        (boot_ms,) = _BOOT_MS.unpack_from(frame.payload.ljust(_SYSTEM_TIME_BYTES, b"\0"), _BOOT_MS_AT)
        if source.boot_ms is not None and boot_ms < source.boot_ms - 1000 * CLOCK_APART_S:
            source.lost, source.sequence = source.lost_by_then, frame.sequence
        source.boot_ms, source.lost_by_then = boot_ms, source.lost


def _rate_hz(times_s: deque[float]) -> float:
    if len(times_s) < 2 or times_s[-1] <= times_s[0]:
        return 0.0
    return (len(times_s) - 1) / (times_s[-1] - times_s[0])
