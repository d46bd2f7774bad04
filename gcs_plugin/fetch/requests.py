"""MAVLink FTP requests under way over a bad link, and the vehicle's listing of its segments, collected from them.

Each request is sent again until answered, and each answer counts once. Does no I/O: packets and times go in, packets
come out. Every transmission has its own sequence number, and the answer is recognised by it. So the round trip is
measured on the transmission that was truly answered (Karn), and a duplicate or late answer to a finished request is
ignored.
"""

from collections import deque
from collections.abc import Hashable
from dataclasses import dataclass, field, replace
from typing import Final

from bridge.wire.ftp import Packet
from bridge.wire.segments import Segment, segment_named

MOST_A_S: Final = 800.0
"""Requests per second, of some 27 bytes each: the hub of a recording takes 32 kB a second from each of its clients."""
MOST_AT_ONCE: Final = 32
FIRST_WAIT_S: Final = 1.0
LEAST_WAIT_S: Final = 0.15
LONGEST_WAIT_S: Final = 4.0


@dataclass
class _Pending:
    """A request without an answer yet: when it was last sent, and the numbers by which its answer is recognised."""

    packet: Packet
    sent_s: float = float("-inf")
    sequences: list[int] = field(default_factory=list)


class Requests:
    """Unanswered requests, each under a key that the caller chose."""

    def __init__(self, now_s: float) -> None:
        self._open: dict[Hashable, _Pending] = {}
        self._new: deque[Hashable] = deque()
        self._sent: dict[int, tuple[Hashable, float]] = {}
        self._sequence = 0
        self._round_trip_s: float | None = None
        self._tokens, self._filled_s = float(MOST_AT_ONCE), now_s  # a token bucket, in requests

    def __len__(self) -> int:
        return len(self._open)

    def ask(self, key: Hashable, packet: Packet) -> None:
        """Send a packet, each time with a new sequence number, until it is answered."""
        self._open[key] = _Pending(packet)
        self._new.append(key)

    def forget(self) -> None:
        """Drop all requests under way."""
        self._open.clear()
        self._new.clear()
        self._sent.clear()

    @property
    def wait_s(self) -> float:
        """How long an answer may take before its request is sent again."""
        if self._round_trip_s is None:
            return FIRST_WAIT_S
        return min(max(2.0 * self._round_trip_s, LEAST_WAIT_S), LONGEST_WAIT_S)

    def tick(self, now_s: float) -> list[Packet]:
        """Return the packets to send now: the overdue requests again, then new ones, within the allowed rate."""
        filled = max(0.0, now_s - self._filled_s) * MOST_A_S
        self._tokens, self._filled_s = min(float(MOST_AT_ONCE), self._tokens + filled), now_s
        late = [key for key, req in self._open.items() if req.sequences and now_s - req.sent_s >= self.wait_s]
        out = []
        while self._tokens >= 1.0 and (late or self._new):
            key = late.pop(0) if late else self._new.popleft()
            pending = self._open.get(key)
            if pending is None:
                continue
            self._sequence = self._sequence + 1 & 0xFFFF
            answer_sequence = self._sequence + 1 & 0xFFFF  # an answer bears the number of its request plus 1
            self._sent[answer_sequence] = key, now_s
            pending.sequences.append(answer_sequence)
            pending.sent_s = now_s
            self._tokens -= 1.0
            out.append(replace(pending.packet, sequence=self._sequence))
        return out

    def answered(self, packet: Packet, now_s: float) -> Hashable | None:
        """Return the key of the request that this packet answers; None if it answers none."""
        key, sent_s = self._sent.get(packet.sequence, (None, now_s))
        pending = self._open.get(key) if key is not None else None
        if pending is None or packet.request != pending.packet.op:
            return None
        del self._open[key]
        for sequence in pending.sequences:
            self._sent.pop(sequence, None)
        took_s = now_s - sent_s
        before_s = took_s if self._round_trip_s is None else self._round_trip_s
        self._round_trip_s = before_s + 0.125 * (took_s - before_s)
        return key


Listing = list[tuple[Segment, int]]
"""Segments with their sizes in bytes."""

MOST_SEGMENTS: Final = 100_000
MOST_BYTES: Final = 0xFFFFFFFF
"""MAVLink FTP states an offset in 32 bits, so the end of a longer file can't be requested."""
_SIZE_DIGITS: Final = 10


class SegmentListing:
    """The vehicle's segments, as far as they are listed; `index` is that of the next entry to request."""

    def __init__(self) -> None:
        self.index = 0
        self._sizes: dict[Segment, int] = {}

    @property
    def is_too_long(self) -> bool:
        """Whether the list is longer than any ring's, so that it may never end."""
        return len(self._sizes) > MOST_SEGMENTS

    def hear(self, packet: Packet) -> bool:
        """Take an answer with the next entries. Return whether it brought a segment that was not listed yet."""
        if packet.offset != self.index:
            return False
        before = len(self._sizes)
        entries = [entry for entry in packet.data.split(b"\0") if entry]
        self.index += len(entries)
        for entry in entries:
            name, _, size = entry[1:].decode("ascii", "replace").partition("\t")
            segment = segment_named(name)
            if (
                segment is not None
                and len(size) <= _SIZE_DIGITS
                and size.isdecimal()
                and int(size) <= MOST_BYTES
            ):
                self._sizes[segment] = int(size)
        return len(self._sizes) > before

    def listing(self) -> Listing:
        """Return the segments, oldest first."""
        return sorted(self._sizes.items())
