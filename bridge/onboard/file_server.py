"""A read-only MAVLink FTP server of the recordings on board, and the thread that runs it.

A session is only a name: no file is held open, and opening a file twice gives the same session. A token bucket for each
link keeps its answers within its pace, as telemetry has priority. Requests that find the queue full are dropped; the
client sends them again.
"""

from collections import deque
from collections.abc import Callable, Iterator
from contextlib import suppress
from dataclasses import dataclass, field, replace
from pathlib import Path
from queue import Empty, Full, Queue
from threading import Event, Thread
from typing import Final

from bridge.clock import Clock
from bridge.files import is_own_file
from bridge.wire.ftp import DATA_BYTES, Fault, Op, Packet, acknowledged, crc32, decode, refused
from bridge.wire.segments import segment_named, segments_in


class Segments:
    """The segments of a ring in `folder`. Any other name counts as missing, so that no path leads out of it.

    Its methods raise OSError if the disk fails, FileNotFoundError for an unknown name.
    """

    def __init__(self, folder: Path) -> None:
        self._folder = folder

    def sizes(self) -> list[tuple[str, int]]:
        """Name and size in bytes of each file, in order."""
        try:
            return [(segment.name, size) for segment, size in segments_in(self._folder)]
        except FileNotFoundError:  # nothing was kept yet
            return []

    def read(self, name: str, offset: int, size: int) -> bytes:
        """Return up to `size` bytes from `offset` on; b"" at the end."""
        path = self._folder / name
        if segment_named(name) is None or not is_own_file(path):
            raise FileNotFoundError(name)
        with path.open("rb", buffering=0) as file:
            file.seek(offset)
            return file.read(size)


Peer = tuple[int, int, int]
"""Link number, and the client's system and component."""

MOST_SESSIONS: Final = 16
MOST_WAITING: Final = 256
MOST_LISTINGS: Final = 8
LISTED_S: Final = 5.0
"""Time for which a peer's listing stays, even if its first part is asked for again: that request may be a late copy."""
IDLE_S: Final = 30.0
BURST_PACKETS: Final = 64
CRC_BYTES_A_STEP: Final = 1 << 18
BUCKET_S: Final = 0.1
"""Depth of a link's token bucket, in seconds of its pace."""
FRAME_BYTES: Final = 27
"""Bytes on the wire around a packet's data."""

_WRITES: Final = frozenset(
    (Op.CREATE, Op.WRITE, Op.REMOVE, Op.MAKE_FOLDER, Op.REMOVE_FOLDER, Op.OPEN_WRITE, Op.TRUNCATE, Op.RENAME)
)


@dataclass
class _Session:
    """A file that a peer reads. `burst` is its burst request, advanced to the packet that is due next.

    `left` is the number of packets left in the burst.
    """

    peer: Peer
    name: str
    used_s: float
    burst: Packet | None = None
    left: int = 0


@dataclass
class _Lane:
    """One link: its waiting requests, and its token bucket: `tokens` bytes may be sent, counted up to `filled_s`."""

    filled_s: float
    tokens: float
    requests: deque[tuple[Peer, Packet]] = field(default_factory=deque)


@dataclass
class _Checksum:
    """A checksum under way: the request that it answers, the file, and the CRC of its first `offset` bytes."""

    peer: Peer
    request: Packet
    name: str
    offset: int = 0
    crc: int = 0


class FileServer:
    """Offers segments for reading. `pace(link)` is the allowed bytes per second on the link with that number."""

    def __init__(self, files: Segments, pace: Callable[[int], float]) -> None:
        self._files, self._pace = files, pace
        self._sessions: dict[int, _Session] = {}
        self._lanes: dict[int, _Lane] = {}
        self._listings: dict[Peer, tuple[float, list[str]]] = {}
        self._checksums: list[_Checksum] = []

    def hear(self, peer: Peer, payload: bytes, now_s: float) -> None:
        """Queue a packet that arrived; a later `due` returns its answer."""
        lane = self._lanes.setdefault(peer[0], _Lane(now_s, self._bucket_bytes(peer[0])))
        if len(lane.requests) < MOST_WAITING:
            lane.requests.append((peer, decode(payload)))

    def due(self, now_s: float) -> list[tuple[Peer, bytes]]:
        """Return the packets to send now, each with its peer."""
        for number in [n for n, session in self._sessions.items() if session.used_s < now_s - IDLE_S]:
            del self._sessions[number]
        out: list[tuple[Peer, bytes]] = []
        for link, lane in self._lanes.items():
            filled = max(0.0, now_s - lane.filled_s) * self._pace(link)
            lane.tokens = min(lane.tokens + filled, self._bucket_bytes(link))
            lane.filled_s = now_s
            for peer, packet in self._lane_due(link, lane, now_s):
                raw = packet.encode()
                lane.tokens -= len(raw) + FRAME_BYTES
                out.append((peer, raw))
        return out + [(peer, packet.encode()) for peer, packet in self._checksum_answers()]

    def _bucket_bytes(self, link: int) -> float:
        """Capacity of a link's bucket: at least one packet, even at a slow pace."""
        return max(self._pace(link) * BUCKET_S, float(DATA_BYTES + FRAME_BYTES))

    def _lane_due(self, link: int, lane: _Lane, now_s: float) -> Iterator[tuple[Peer, Packet]]:
        while lane.requests and (lane.tokens > 0 or _is_free(lane.requests[0][1])):
            peer, request = lane.requests.popleft()
            answer = self._answer(peer, request, now_s)
            if answer is not None:
                yield peer, answer
        bursting = deque(
            number for number, reading in self._sessions.items() if reading.peer[0] == link and reading.burst
        )
        while bursting and lane.tokens > 0:
            number = bursting.popleft()
            session = self._sessions[number]
            yield session.peer, self._burst_next(session, now_s)
            if session.burst is not None:
                bursting.append(number)

    def _answer(self, peer: Peer, request: Packet, now_s: float) -> Packet | None:
        """Return the answer to a request; None if it gets none, or gets it later."""
        try:
            if request.op == Op.LIST:
                return self._listed(peer, request, now_s)
            if request.op == Op.OPEN_READ:
                return self._opened(peer, request, now_s)
            if request.op == Op.CRC32:
                return self._begin_checksum(peer, request)
            if request.op in (Op.READ, Op.BURST, Op.TERMINATE):
                return self._of_session(peer, request, now_s)
        except FileNotFoundError:
            return refused(request, Fault.NOT_FOUND)
        except OSError:
            return refused(request, Fault.FAIL)
        if request.op == Op.RESET:
            self._sessions = {n: session for n, session in self._sessions.items() if session.peer != peer}
            return acknowledged(request)
        if request.op in (Op.ACK, Op.NAK):  # never answered: two servers would answer each other without end
            return None
        return refused(request, Fault.PROTECTED if request.op in _WRITES else Fault.UNKNOWN)

    def _listed(self, peer: Peer, request: Packet, now_s: float) -> Packet:
        if _name(request.data) not in ("", "."):
            raise FileNotFoundError
        # A listing is a snapshot: if it changed between requests, a client that lists by index could miss a file.
        listed_s, entries = self._listings.get(peer, (now_s, []))
        if not entries or (request.offset == 0 and now_s - listed_s >= LISTED_S):
            if len(self._listings) >= MOST_LISTINGS:
                self._listings.pop(next(iter(self._listings)), None)
            entries = [f"F{name}\t{size}\0" for name, size in self._files.sizes()]
            self._listings[peer] = now_s, entries
        data = b""
        for entry in entries[request.offset :]:
            if len(data) + len(entry) > DATA_BYTES:
                break
            data += entry.encode("ascii")
        return acknowledged(request, data) if data else refused(request, Fault.END)

    def _opened(self, peer: Peer, request: Packet, now_s: float) -> Packet:
        name = _name(request.data)
        size = dict(self._files.sizes()).get(name)
        if size is None:
            raise FileNotFoundError
        same = (n for n, session in self._sessions.items() if (session.peer, session.name) == (peer, name))
        free = (n for n in range(MOST_SESSIONS) if n not in self._sessions)
        # If a TERMINATE was lost, the peer's own oldest session gives way to its next.
        oldest_first = sorted(
            (session.used_s, n) for n, session in self._sessions.items() if session.peer == peer
        )
        number = next(same, next(free, oldest_first[0][1] if oldest_first else None))
        if number is None:
            return refused(request, Fault.NO_SESSIONS)
        self._sessions[number] = _Session(peer, name, now_s)
        return acknowledged(request, min(size, 0xFFFFFFFF).to_bytes(4, "little"), 0, number)

    def _of_session(self, peer: Peer, request: Packet, now_s: float) -> Packet | None:
        session = self._sessions.get(request.session)
        if request.op == Op.TERMINATE:
            if session is not None and session.peer == peer:
                del self._sessions[request.session]
            return acknowledged(request)
        if session is None or session.peer != peer:
            return refused(request, Fault.SESSION)
        if not 0 < request.size <= DATA_BYTES:
            return refused(request, Fault.SIZE)
        session.used_s = now_s
        if request.op == Op.BURST:
            session.burst, session.left = request, BURST_PACKETS
            return None
        data = self._files.read(session.name, request.offset, request.size)
        return acknowledged(request, data) if data else refused(request, Fault.END)

    def _burst_next(self, session: _Session, now_s: float) -> Packet:
        request = session.burst
        assert request is not None
        session.used_s, session.burst = now_s, None
        session.left -= 1
        try:
            data = self._files.read(session.name, request.offset, request.size)
        except FileNotFoundError:
            return refused(request, Fault.NOT_FOUND)
        except OSError:
            return refused(request, Fault.FAIL)
        if not data:
            return refused(request, Fault.END)
        complete = len(data) < request.size or session.left == 0
        if not complete:
            session.burst = replace(
                request, sequence=request.sequence + 1 & 0xFFFF, offset=request.offset + len(data)
            )
        return replace(acknowledged(request, data), complete=complete)

    def _begin_checksum(self, peer: Peer, request: Packet) -> Packet | None:
        name = _name(request.data)
        self._files.read(name, 0, 1)
        if len(self._checksums) >= MOST_LISTINGS:
            return refused(request, Fault.FAIL)
        for pending in self._checksums:
            if (pending.peer, pending.name) == (peer, name):  # asked again: the work done so far is kept
                pending.request = request
                return None
        self._checksums.append(_Checksum(peer, request, name))
        return None

    def _checksum_answers(self) -> list[tuple[Peer, Packet]]:
        """Continue the first checksum by a piece; return its answer once it is complete."""
        if not self._checksums:
            return []
        work = self._checksums[0]
        try:
            data = self._files.read(work.name, work.offset, CRC_BYTES_A_STEP)
        except OSError:
            del self._checksums[0]
            return [(work.peer, refused(work.request, Fault.FAIL))]
        work.crc, work.offset = crc32(data, work.crc), work.offset + len(data)
        if data:
            return []
        del self._checksums[0]
        return [(work.peer, acknowledged(work.request, work.crc.to_bytes(4, "little")))]


def _name(data: bytes) -> str:
    """Name of a path at the root. Bytes other than ASCII are replaced, so that such a name matches no file."""
    return data.split(b"\0")[0].decode("ascii", "replace").removeprefix("/")


def _is_free(request: Packet) -> bool:
    """Whether a request is refused at once, whatever the pace: no client should wait for that."""
    return request.op in _WRITES or (request.op == Op.OPEN_READ and request.data.startswith(b"@"))


TICK_S: Final = 0.02
MOST_HEARD: Final = 512
MOST_ANSWERS: Final = 512
ENDING_S: Final = 3.0


class ThreadedFileServer:
    """A `FileServer` in a thread of its own, so that a slow disk holds up no loop: `hear` and `due` return at once.

    Answers are ready at a later call of `due`.
    """

    def __init__(self, server: FileServer, clock: Clock) -> None:
        self._server, self._clock = server, clock
        self._heard: Queue[tuple[Peer, bytes]] = Queue(MOST_HEARD)
        self._answers: deque[tuple[Peer, bytes]] = deque()
        self._stop = Event()
        self._thread = Thread(target=self._run, name="file server", daemon=True)
        self._thread.start()

    def hear(self, peer: Peer, payload: bytes, now_s: float) -> None:
        """Queue a packet that arrived, or drop it if the queue is full; the client asks for it again."""
        del now_s
        with suppress(Full):
            self._heard.put_nowait((peer, payload))

    def due(self, now_s: float) -> list[tuple[Peer, bytes]]:
        """Return the answers that are ready to send."""
        del now_s
        return [self._answers.popleft() for _ in range(len(self._answers))]

    def close(self) -> None:
        """End the thread; a disk that stalls is not waited for long."""
        self._stop.set()
        self._thread.join(ENDING_S)

    def _run(self) -> None:
        while not self._stop.is_set():
            with suppress(Empty):
                self._server.hear(*self._heard.get(timeout=TICK_S), self._clock.boot_s())
                for _ in range(self._heard.qsize()):
                    self._server.hear(*self._heard.get_nowait(), self._clock.boot_s())
            # No more answers are made while the loop does not fetch them.
            if len(self._answers) < MOST_ANSWERS:
                self._answers.extend(self._server.due(self._clock.boot_s()))
