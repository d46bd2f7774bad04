"""How well a link carries: loss by sequence number, age and rate of each message, as seen here."""

from collections import deque
from dataclasses import dataclass, field
from typing import Final

from bridge.framing import Frame

SEQUENCES: Final = 256
LATE: Final = 128  # a gap that wide is a frame that came late, not half a round of lost ones
RESTART_S: Final = 5.0  # after so long a silence the numbers may have started anew
RATE_WINDOW: Final = 20


@dataclass(frozen=True, slots=True)
class SourceHealth:
    """What came from one component of one system; routers can falsify `lost`."""

    system: int
    component: int
    received: int
    lost: int
    age_s: float

    @property
    def loss(self) -> float:
        """Fraction of its frames that did not arrive here."""
        return self.lost / max(self.received + self.lost, 1)


@dataclass(frozen=True, slots=True)
class MessageHealth:
    """How old and how frequent one kind of message is; `rate_hz` is 0 before the second."""

    system: int
    component: int
    message_id: int
    count: int
    age_s: float
    rate_hz: float


@dataclass(frozen=True)
class Health:
    """A link at one instant."""

    sources: tuple[SourceHealth, ...]
    messages: tuple[MessageHealth, ...]

    def age_s(self, message_id: int) -> float:
        """Age of the newest message of a kind from anyone; inf where none came."""
        return min((m.age_s for m in self.messages if m.message_id == message_id), default=float("inf"))


@dataclass
class _Source:
    sequence: int
    last_s: float
    received: int = 1
    lost: int = 0


@dataclass
class _Message:
    count: int = 0
    times_s: deque[float] = field(default_factory=lambda: deque(maxlen=RATE_WINDOW))


class LinkHealth:
    """Counts of one link. Only frames with a checked CRC count: an unknown id proves nothing."""

    def __init__(self) -> None:
        self._sources: dict[tuple[int, int], _Source] = {}
        self._messages: dict[tuple[int, int, int], _Message] = {}

    def on_frame(self, frame: Frame, time_s: float) -> None:
        if not frame.known:
            return
        key = (frame.system, frame.component)
        source = self._sources.get(key)
        if source is None:
            self._sources[key] = _Source(frame.sequence, time_s)
        else:
            self._count(source, frame.sequence, time_s)
        message = self._messages.setdefault((*key, frame.message_id), _Message())
        message.count += 1
        message.times_s.append(time_s)

    def snapshot(self, now_s: float) -> Health:
        sources = [
            SourceHealth(*key, s.received, s.lost, now_s - s.last_s) for key, s in self._sources.items()
        ]
        messages = [
            MessageHealth(*key, m.count, now_s - m.times_s[-1], _rate_hz(m.times_s))
            for key, m in self._messages.items()
        ]
        return Health(tuple(sources), tuple(messages))

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


def _rate_hz(times_s: deque[float]) -> float:
    if len(times_s) < 2 or times_s[-1] <= times_s[0]:
        return 0.0
    return (len(times_s) - 1) / (times_s[-1] - times_s[0])
