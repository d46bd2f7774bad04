"""How well a link carries: loss by sequence number, age and rate of each message, as seen here."""

from collections import deque
from dataclasses import dataclass, field
from typing import Final

from bridge.framing import Frame

SEQUENCES: Final = 256
LATE: Final = 128  # a gap that wide is a frame that came late, not half a round of lost ones
RESTART_S: Final = 5.0  # after so long a silence the numbers may have started anew
RATE_WINDOW: Final = 20
MOST_SOURCES: Final = 256  # components: far more than any fleet has
MOST_KINDS: Final = 4096  # kinds of messages of all of them: some 5 MB
CROWDED: Final = "more senders or kinds of messages than any fleet has, so somebody makes up addresses"


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
    """A link at one instant; `left_out` are the frames of senders and kinds for which there was no place."""

    sources: tuple[SourceHealth, ...]
    messages: tuple[MessageHealth, ...]
    left_out: int = 0

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
    """Counts of one link. Only frames with a checked CRC count: an unknown id proves nothing.

    Who came first keeps his place, so that a sender of made-up addresses fills neither the memory nor the place of
    the vehicle; frames of those who came too late are counted in `left_out`.
    """

    def __init__(self) -> None:
        self.left_out = 0
        self._sources: dict[tuple[int, int], _Source] = {}
        self._messages: dict[tuple[int, int, int], _Message] = {}

    def on_frame(self, frame: Frame, time_s: float) -> None:
        if not frame.known:
            return
        key = (frame.system, frame.component)
        source = self._sources.get(key)
        if source is None:
            if len(self._sources) >= MOST_SOURCES:
                self.left_out += 1
                return
            self._sources[key] = _Source(frame.sequence, time_s)
        else:
            self._count(source, frame.sequence, time_s)
        kind = (*key, frame.message_id)
        message = self._messages.get(kind)
        if message is None:
            if len(self._messages) >= MOST_KINDS:
                self.left_out += 1
                return
            message = self._messages[kind] = _Message()
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
        return Health(tuple(sources), tuple(messages), self.left_out)

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
