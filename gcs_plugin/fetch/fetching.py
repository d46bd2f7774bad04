"""Fetch segments from the vehicle: the list, then the bytes of each segment in order, then its checksum.

`Fetching` does no I/O except to the mirror on disk; `fetch` runs it over a link. The mirror always holds the beginning
of a segment without a gap, so a fetch resumes at its end after a lost link, a killed program or a restart of the
vehicle. No answer is trusted: an answer without a request is ignored, and only progress counts as hearing the vehicle,
so a vehicle can't keep the ground busy with answers that bring nothing.
"""

from collections.abc import Callable, Hashable
from enum import Enum, auto
from typing import Final

from pymavlink.dialects.v20 import ardupilotmega as dialect

from bridge.clock import Clock
from bridge.errors import LinkError, LinkTimeout
from bridge.links.link import Link
from bridge.wire.framing import Encoder, Framer
from bridge.wire.ftp import DATA_BYTES, Fault, Op, Packet, decode
from bridge.wire.segments import Segment
from gcs_plugin.fetch.mirror import Mirror, Stretch
from gcs_plugin.fetch.requests import MOST_AT_ONCE, MOST_SEGMENTS, Listed, Listing, Requests
from gcs_plugin.peers import GROUND_STATION, ground_heartbeat

MOST_TRIES: Final = 3
"""How often a segment may arrive with a wrong checksum."""
MOST_AHEAD: Final = 1 << 18
"""Bytes that may wait in memory for an earlier piece that is still missing."""
SUM_BYTES: Final = 4


class _Stage(Enum):
    LIST = auto()
    OPEN = auto()
    COMPARE = auto()
    READ = auto()
    SUM = auto()
    DONE = auto()


class Fetching:
    """Fetch the segments that `choose` picks from the vehicle's list into `mirror`.

    Send the packets of `tick` and pass every packet received to `on_packet`, until `done`. `fault` says why the fetch
    failed; "" means no failure. `heard_s` is the time of its last progress.
    """

    def __init__(self, mirror: Mirror, choose: Callable[[Listing], Listing], now_s: float) -> None:
        self.fault = ""
        self.heard_s = now_s
        self.fetched = 0
        self.chosen: Listing = []
        self._mirror, self._choose = mirror, choose
        self._requests = Requests(now_s)
        self._stage = _Stage.LIST
        self._now_s = now_s
        self._listed = Listed()
        self._left: Listing = []
        self._segment = self._newest = Segment(0, 0, 0, 0)
        self._size = self._session = self._kept = self._asked = self._tries = 0
        self._held = 0
        self._doubted: list[Stretch] | None = None
        self._pieces: dict[int, bytes] = {}
        self._ask_list()

    @property
    def done(self) -> bool:
        return self._stage is _Stage.DONE

    @property
    def held_bytes(self) -> int:
        """How many bytes of the chosen segments are in the mirror."""
        return self._held

    @property
    def total_bytes(self) -> int:
        """Size of the chosen segments, in bytes."""
        return sum(size for _, size in self.chosen)

    def tick(self, now_s: float) -> list[Packet]:
        if self._stage is _Stage.READ:
            self._ask_reads()
        return self._requests.tick(now_s)

    def on_packet(self, packet: Packet, now_s: float) -> None:
        """Handle a packet from the vehicle. Raises LogError if the disk can't be written."""
        key = self._requests.answered(packet, now_s)
        if key is None:
            return
        self._now_s = now_s
        fault = Fault(packet.data[0]) if packet.op == Op.NAK and packet.data[:1] in _FAULTS else Fault.FAIL
        granted = packet.op == Op.ACK
        if self._stage is _Stage.LIST:
            self._on_list(packet, granted, fault)
        elif not granted and fault is Fault.NOT_FOUND:
            self._next()  # the ring has let it go: what was fetched of it is kept
        elif self._stage is _Stage.OPEN:
            self._on_open(packet, granted)
        elif self._stage is _Stage.COMPARE:
            self._on_compared(packet, granted, fault)
        elif self._stage is _Stage.READ:
            self._on_read(key, packet, granted, fault)
        elif self._stage is _Stage.SUM:
            self._on_sum(packet, granted)

    def _nearer(self) -> None:
        self.heard_s = self._now_s

    def _ask_list(self) -> None:
        self._requests.ask("list", Packet(0, 0, Op.LIST, 1, offset=self._listed.index, data=b"/"))

    def _on_list(self, packet: Packet, granted: bool, fault: Fault) -> None:
        if granted and self._listed.hear(packet):
            self._nearer()
        if self._listed.is_too_long:
            self._fail(
                f"the vehicle lists more than {MOST_SEGMENTS} files; clear the folder of its bridge's --ring"
            )
        elif not granted and fault is Fault.END:
            self._begin()
        elif not granted and fault in (Fault.UNKNOWN, Fault.NOT_FOUND):
            self._fail("the vehicle keeps no recording of its own; start its bridge with --ring FOLDER")
        else:
            self._ask_list()

    def _begin(self) -> None:
        """Choose segments once the list is complete. Raises LogError if none is wanted, or the disk is too small."""
        listing = self._listed.listing()
        self.chosen = self._choose(listing)
        if listing:
            self._newest = listing[-1][0]
        self._held = sum(min(self._mirror.size(segment.name), size) for segment, size in self.chosen)
        # The missing bytes, plus the size of all segments for the recording that is made from them.
        self._mirror.need(2 * self.total_bytes - self._held)
        self._left = self.chosen[::-1]
        self._next()

    def _next(self) -> None:
        """Begin the next segment: request an incomplete segment's missing bytes, or a complete segment's checksum."""
        self._requests.forget()
        self._pieces.clear()
        self._nearer()
        while self._left:
            self._segment, self._size = self._left.pop()
            name = self._segment.name
            self._tries = 0
            self._doubted = None
            if self._mirror.is_whole(name):
                self._ask_sum()
            else:
                self._open()
            return
        self._stage = _Stage.DONE

    @property
    def _is_growing(self) -> bool:
        """Whether the vehicle may still write to this segment, so that the checksum of the listed bytes is unknown.

        A segment that is complete here was closed on the vehicle, so its checksum is requested all the same.
        """
        return self._segment == self._newest

    def _open(self) -> None:
        self._requests.forget()
        self._pieces.clear()
        self._kept = self._asked = self._mirror.size(self._segment.name)
        if self._kept > self._size and self._is_growing:
            self._drop()
        if self._kept >= self._size and not (self._is_growing and self._kept):
            self._finish()
            return
        self._stage = _Stage.OPEN
        name = self._segment.name.encode("ascii")
        self._requests.ask("open", Packet(0, 0, Op.OPEN_READ, len(name), data=name))

    def _on_open(self, packet: Packet, granted: bool) -> None:
        if granted:
            self._session = packet.session
            if self._is_growing and self._kept:
                self._doubt()
            else:
                self._stage = _Stage.READ
        else:
            self._open()

    def _doubt(self) -> None:
        """Compare bytes of a growing segment with the vehicle's, because no checksum can confirm them yet.

        The last bytes come first, to show whether this is still the same file; then everything that is not an intact
        frame.
        """
        name, size = self._segment.name, min(DATA_BYTES, self._kept)
        if self._doubted is None:
            self._doubted = self._mirror.doubtful(name)[::-1]
        tail = self._kept - size, size
        if self._doubted[-1:] != [tail]:
            self._doubted.append(tail)
        self._compare()

    def _compare(self) -> None:
        """Request the next doubtful bytes for comparison; when none are left, continue reading."""
        if self._doubted:
            at, size = self._doubted[-1]
            self._stage = _Stage.COMPARE
            asked = Packet(0, self._session, Op.READ, min(size, DATA_BYTES), offset=at)
            self._requests.ask("compare", asked)
        else:
            self._stage = _Stage.READ
            self._keep()

    def _on_compared(self, packet: Packet, granted: bool, fault: Fault) -> None:
        assert self._doubted
        at, left = self._doubted[-1]
        size = min(left, DATA_BYTES)
        answered = granted and packet.offset == at and len(packet.data) == size
        if answered and packet.data == self._mirror.piece(self._segment.name, at, size):
            self._doubted[-1:] = [(at + size, left - size)] if left > size else []
            self._nearer()
            self._compare()
        elif answered or fault is Fault.END:
            self._drop()
            self._open()
        elif fault is Fault.SESSION:
            self._open()
        else:
            self._compare()

    def _drop(self) -> None:
        """Discard the bytes here of a segment: they are not the vehicle's."""
        self._held -= min(self._mirror.size(self._segment.name), self._size)
        self._mirror.drop(self._segment.name)
        self._kept = self._asked = 0
        self._doubted = []

    def _ask_reads(self) -> None:
        end = min(self._size, self._kept + MOST_AHEAD)
        while len(self._requests) < MOST_AT_ONCE and self._asked < end:
            size = min(DATA_BYTES, self._size - self._asked)
            self._ask_read(self._asked, size)
            self._asked += size

    def _ask_read(self, offset: int, size: int) -> None:
        self._requests.ask((offset, size), Packet(0, self._session, Op.READ, size, offset=offset))

    def _on_read(self, key: Hashable, packet: Packet, granted: bool, fault: Fault) -> None:
        assert isinstance(key, tuple)
        offset, size = key
        if not granted:
            if fault is Fault.SESSION:  # the vehicle restarted, or has forgotten this session
                self._open()
            elif fault is Fault.END:
                # The vehicle lost the rest of it, for example in a power failure.
                self._size = min(self._size, offset)
                self._asked = min(self._asked, self._size)
                if self._kept >= self._size:
                    self._finish()
            else:
                self._ask_read(offset, size)
            return
        if packet.offset != offset or not 0 < len(packet.data) <= size:
            self._ask_read(offset, size)
            return
        self._pieces[offset] = packet.data
        if len(packet.data) < size:
            self._ask_read(offset + len(packet.data), size - len(packet.data))
        self._keep()

    def _keep(self) -> None:
        """Write the pieces to disk that directly follow the bytes held."""
        ready = []
        at = self._kept
        while at in self._pieces:
            ready.append(self._pieces.pop(at))
            at += len(ready[-1])
        if ready:
            self._mirror.append(self._segment.name, b"".join(ready))
            self.fetched += at - self._kept
            self._held += at - self._kept
            self._kept = at
            self._nearer()
        if at >= self._size:
            self._finish()

    def _finish(self) -> None:
        """All bytes have arrived: request the checksum, unless the segment is still growing."""
        self._requests.forget()
        self._pieces.clear()
        if self._is_growing:
            self._next()
        else:
            self._ask_sum()

    def _ask_sum(self) -> None:
        self._stage = _Stage.SUM
        name = self._segment.name.encode("ascii")
        self._requests.ask("sum", Packet(0, self._session, Op.CRC32, len(name), data=name))

    def _on_sum(self, packet: Packet, granted: bool) -> None:
        name = self._segment.name
        complete = self._mirror.is_whole(name)
        if not granted:
            if complete:  # the vehicle can no longer compute it; the checksum was right when this was fetched
                self._next()
            else:
                self._ask_sum()
            return
        if packet.data[:SUM_BYTES] == self._mirror.checksum(name).to_bytes(SUM_BYTES, "little"):
            if not complete:
                self._mirror.finish(name)
            self._next()
            return
        if complete:
            self._held -= min(self._mirror.size(name), self._size)
            self._mirror.set_aside(name)
        else:
            self._drop()
        self._tries += 1
        if self._tries >= MOST_TRIES:
            self._fail(f"{name}: arrived {MOST_TRIES} times with a wrong checksum; check the vehicle's disk")
        else:
            self._open()

    def _fail(self, fault: str) -> None:
        self.fault, self._stage = fault, _Stage.DONE


_FAULTS: Final = frozenset(bytes((fault,)) for fault in Fault)


POLL_S: Final = 0.01
BEAT_EVERY_S: Final = 1.0
TELL_EVERY_S: Final = 0.2
_FTP: Final[int] = dialect.MAVLINK_MSG_ID_FILE_TRANSFER_PROTOCOL
_TARGET_BYTES: Final = 3  # network, system, component


def fetch(
    link: Link,
    clock: Clock,
    fetching: Fetching,
    vehicle: tuple[int, int],
    patience_s: float,
    progress: Callable[[Fetching], None],
) -> None:
    """Drive `fetching` over `link` until it is done. Every wait is a read of the link with a timeout.

    Raises LinkTimeout if the vehicle gives no useful answer for `patience_s`, and LinkError if it can't deliver. The
    bytes fetched so far are kept, and the next fetch resumes after them.
    """
    encoder, framer = Encoder(*GROUND_STATION), Framer()
    beat_s = report_s = clock.boot_s()
    while not fetching.done:
        now_s = clock.boot_s()
        out = [encoder.frame(_FTP, bytes((0, *vehicle)) + packet.encode()) for packet in fetching.tick(now_s)]
        if now_s >= beat_s:
            beat_s = now_s + BEAT_EVERY_S
            out.append(encoder.encode(ground_heartbeat()))
        if out:
            link.write(b"".join(out))
        for frame in framer.feed(link.read(POLL_S)):
            if frame.message_id != _FTP or (frame.system, frame.component) != vehicle:
                continue
            target, payload = frame.payload[:_TARGET_BYTES], frame.payload[_TARGET_BYTES:]
            if target == bytes((0, *GROUND_STATION)):
                fetching.on_packet(decode(payload), clock.boot_s())
        if clock.boot_s() >= report_s:
            report_s = clock.boot_s() + TELL_EVERY_S
            progress(fetching)
        if clock.boot_s() - fetching.heard_s > patience_s:
            raise LinkTimeout(
                f"{link.name}: the vehicle has answered nothing for {patience_s:.0f} s; what was fetched is kept, "
                "fetch again and it goes on from there"
            )
    if fetching.fault:
        raise LinkError(fetching.fault)
