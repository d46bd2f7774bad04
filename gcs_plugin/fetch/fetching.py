"""Fetch segments from the vehicle: the list, then the bytes of each segment in order, then its checksum.

`Fetching` does no I/O except to the mirror on disk; `fetch` runs it over a link. The mirror always holds the beginning
of a segment without a gap, so a fetch resumes at its end after a lost link, a killed program or a restart of the
vehicle. No answer is trusted: an answer without a request is ignored, and only progress counts as hearing the vehicle,
so a vehicle can't keep the ground busy with answers that bring nothing.
"""

from collections.abc import Callable, Generator, Hashable
from typing import Final, NamedTuple, TypeVar

from pymavlink.dialects.v20 import ardupilotmega as dialect

from bridge.clock import Clock
from bridge.errors import LinkError, LinkTimeout
from bridge.links.link import Link
from bridge.wire.framing import Encoder, Framer
from bridge.wire.ftp import DATA_BYTES, Fault, Op, Packet, decode
from bridge.wire.segments import Segment
from gcs_plugin.fetch.mirror import Mirror, Stretch
from gcs_plugin.fetch.requests import MOST_AT_ONCE, MOST_SEGMENTS, Listing, Requests, SegmentListing
from gcs_plugin.peers import GROUND_STATION, ground_heartbeat

MOST_TRIES: Final = 3
"""How often a segment may arrive with a wrong checksum."""
MOST_AHEAD: Final = 1 << 18
"""Bytes that may wait in memory for an earlier piece that is still missing."""
SUM_BYTES: Final = 4
_FAULTS: Final = frozenset(bytes((fault,)) for fault in Fault)


class _Answer(NamedTuple):
    """The answer to the request of that key; `fault` says why it was not granted, None if it was."""

    key: Hashable
    packet: Packet
    fault: Fault | None


Result = TypeVar("Result")
Steps = Generator[None, _Answer, Result]
"""Asks, and is sent each answer."""


class _LetGoError(Exception):
    """The vehicle's ring has let the segment go."""


class Fetching:
    """Fetch the segments that `choose` picks from the vehicle's list into `mirror`.

    Send the packets of `tick` and pass every packet received to `on_packet`, until `done`. `fault` says why the fetch
    failed; "" means no failure. `heard_s` is the time of its last progress, `held_bytes` how many bytes of the
    chosen segments are in the mirror.
    """

    def __init__(self, mirror: Mirror, choose: Callable[[Listing], Listing], now_s: float) -> None:
        self.fault = ""
        self.done = False
        self.heard_s = now_s
        self.fetched = 0
        self.chosen: Listing = []
        self._mirror, self._choose = mirror, choose
        self._requests = Requests(now_s)
        self._now_s = now_s
        self._segment = self._newest = Segment(0, 0, 0, 0)
        self._size = self._session = self._kept = self._asked = self.held_bytes = 0
        self._doubted: list[Stretch] | None = None
        self._pieces: dict[int, bytes] = {}
        self._steps = self._fetch()
        next(self._steps)

    @property
    def total_bytes(self) -> int:
        """Size of the chosen segments, in bytes."""
        return sum(size for _, size in self.chosen)

    def tick(self, now_s: float) -> list[Packet]:
        return self._requests.tick(now_s)

    def on_packet(self, packet: Packet, now_s: float) -> None:
        """Handle a packet from the vehicle. Raises LogError if the disk can't be written."""
        key = self._requests.answered(packet, now_s)
        if key is None or self.done:
            return
        self._now_s = now_s
        known = packet.op == Op.NAK and packet.data[:1] in _FAULTS
        fault = None if packet.op == Op.ACK else Fault(packet.data[0]) if known else Fault.FAIL
        try:
            self._steps.send(_Answer(key, packet, fault))
        except StopIteration:
            self.done = True

    def _nearer(self) -> None:
        self.heard_s = self._now_s

    def _fetch(self) -> Steps[None]:
        listing = yield from self._list()
        if listing is None:
            return
        self.chosen = self._choose(listing)
        if listing:
            self._newest = listing[-1][0]
        self.held_bytes = sum(min(self._mirror.size(segment.name), size) for segment, size in self.chosen)
        # The missing bytes, plus the size of all segments for the recording that is made from them.
        self._mirror.require_space(2 * self.total_bytes - self.held_bytes)
        for segment, size in self.chosen:
            self._segment, self._size = segment, size
            try:
                yield from self._whole()
            except _LetGoError:
                self._forget()  # what was fetched of it is kept
            if self.fault:
                return
        self._nearer()

    def _list(self) -> Steps[Listing | None]:
        """The vehicle's list; None with `fault` if it has none, or one without end."""
        listed = SegmentListing()
        while True:
            self._requests.ask("list", Packet(0, 0, Op.LIST, 1, offset=listed.index, data=b"/"))
            answer = yield
            if answer.fault is None and listed.hear(answer.packet):
                self._nearer()
            if listed.is_too_long:
                most = f"more than {MOST_SEGMENTS} files"
                self.fault = f"the vehicle lists {most}; clear the folder of its bridge's --ring"
                return None
            if answer.fault is Fault.END:
                return listed.listing()
            if answer.fault in (Fault.UNKNOWN, Fault.NOT_FOUND):
                self.fault = "the vehicle keeps no recording of its own; start its bridge with --ring FOLDER"
                return None

    def _ask(self, key: Hashable, packet: Packet) -> Steps[_Answer]:
        self._requests.ask(key, packet)
        return (yield from self._answer())

    def _answer(self) -> Steps[_Answer]:
        answer = yield
        if answer.fault is Fault.NOT_FOUND:
            raise _LetGoError
        return answer

    def _forget(self) -> None:
        """Drop all requests, and the pieces that can't be written yet."""
        self._requests.forget()
        self._pieces.clear()

    @property
    def _is_growing(self) -> bool:
        """Whether the vehicle may still write to this segment, so that the checksum of the listed bytes is unknown.

        A segment that is complete here was closed on the vehicle, so its checksum is requested all the same.
        """
        return self._segment == self._newest

    def _whole(self) -> Steps[None]:
        """Fetch the missing bytes of the segment, and compare its checksum."""
        self._nearer()
        self._doubted = None
        name = self._segment.name
        for _ in range(MOST_TRIES):
            was_whole = self._mirror.is_whole(name)
            if not was_whole:
                yield from self._bytes()
                if self._is_growing:
                    return
            asked = Packet(0, self._session, Op.CRC32, len(name), data=name.encode("ascii"))
            while (answer := (yield from self._ask("sum", asked))).fault is not None:
                # The vehicle can no longer compute it: the checksum was right when this was fetched.
                if was_whole:
                    return
            if answer.packet.data[:SUM_BYTES] == self._mirror.checksum(name).to_bytes(SUM_BYTES, "little"):
                if not was_whole:
                    self._mirror.finish(name)
                return
            if was_whole:
                self.held_bytes -= min(self._mirror.size(name), self._size)
                self._mirror.set_aside(name)
            else:
                self._drop()
        self.fault = f"{name}: arrived {MOST_TRIES} times with a wrong checksum; check the vehicle's disk"

    def _bytes(self) -> Steps[None]:
        """Open the segment, and again where that is lost, until all its bytes are here."""
        name = self._segment.name
        while True:
            self._forget()
            self._kept = self._asked = self._mirror.size(name)
            if self._kept > self._size and self._is_growing:
                self._drop()
            if self._kept >= self._size and not (self._is_growing and self._kept):
                return
            asked = Packet(0, 0, Op.OPEN_READ, len(name), data=name.encode("ascii"))
            answer = yield from self._ask("open", asked)
            if answer.fault is None:
                self._session = answer.packet.session
                if (yield from self._compared()) and (yield from self._read()):
                    self._forget()
                    return

    def _compared(self) -> Steps[bool]:
        """Compare bytes of a growing segment with the vehicle's, because no checksum can confirm them yet.

        The last bytes come first, to show whether this is still the same file; then everything that is not an intact
        frame. Returns False if it has to be opened anew.
        """
        if not (self._is_growing and self._kept):
            return True
        name, size = self._segment.name, min(DATA_BYTES, self._kept)
        if self._doubted is None:
            self._doubted = self._mirror.doubtful(name)[::-1]
        tail = self._kept - size, size
        if self._doubted[-1:] != [tail]:
            self._doubted.append(tail)
        while self._doubted:
            at, left = self._doubted[-1]
            size = min(left, DATA_BYTES)
            answer = yield from self._ask("compare", Packet(0, self._session, Op.READ, size, offset=at))
            data = answer.packet.data
            answered = answer.fault is None and answer.packet.offset == at and len(data) == size
            if answered and data == self._mirror.read(name, at, size):
                self._doubted[-1:] = [(at + size, left - size)] if left > size else []
                self._nearer()
            elif answered or answer.fault is Fault.END:
                self._drop()
                return False
            elif answer.fault is Fault.SESSION:
                return False
        return True

    def _drop(self) -> None:
        """Discard the bytes here of a segment: they are not the vehicle's."""
        self.held_bytes -= min(self._mirror.size(self._segment.name), self._size)
        self._mirror.drop(self._segment.name)
        self._kept = self._asked = 0
        self._doubted = []

    def _read(self) -> Steps[bool]:
        """Read the missing bytes, many pieces at once. Returns False if the segment has to be opened anew."""
        while self._kept < self._size:
            self._ask_reads()
            key, packet, fault = yield from self._answer()
            assert isinstance(key, tuple)
            offset, size = key
            if fault is Fault.SESSION:  # the vehicle restarted, or has forgotten this session
                return False
            if fault is Fault.END:
                # The vehicle lost the rest of it, for example in a power failure.
                self._size = min(self._size, offset)
                self._asked = min(self._asked, self._size)
            elif fault is not None or packet.offset != offset or not 0 < len(packet.data) <= size:
                self._ask_read(offset, size)
            else:
                self._pieces[offset] = packet.data
                if len(packet.data) < size:
                    self._ask_read(offset + len(packet.data), size - len(packet.data))
                self._keep()
        return True

    def _ask_reads(self) -> None:
        end = min(self._size, self._kept + MOST_AHEAD)
        while len(self._requests) < MOST_AT_ONCE and self._asked < end:
            size = min(DATA_BYTES, self._size - self._asked)
            self._ask_read(self._asked, size)
            self._asked += size

    def _ask_read(self, offset: int, size: int) -> None:
        self._requests.ask((offset, size), Packet(0, self._session, Op.READ, size, offset=offset))

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
            self.held_bytes += at - self._kept
            self._kept = at
            self._nearer()


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
