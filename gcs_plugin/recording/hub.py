"""The hub: passes a recording's frames to other programs on this computer, and their frames to the vehicle.

It listens on loopback only and never blocks: bytes that a client can't take yet are kept up to a bound, and a client
that exceeds the bound is dropped, as is a client that floods the hub or does not speak MAVLink. Loopback damages no
bytes, so bytes outside of frames come from a stranger, such as a browser that was led here; no frame that arrived with
them is passed on. A program that finds all PLACES taken is told so and disconnected.
"""

import socket
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, field
from enum import Enum, auto
from functools import cache
from typing import Final

from pymavlink.dialects.v20 import ardupilotmega as dialect

from bridge.clock import Clock
from bridge.errors import LinkError
from bridge.links.addresses import LOOPBACK
from bridge.wire.framing import Encoder, Frame, Framer
from gcs_plugin.peers import GROUND_STATION

PLACES: Final = 32
"""Number of programs that may be connected at a time."""

FULL: Final = (
    f"{PLACES} programs are connected to the recording already, and one more is refused: end one of them"
)
"""Warning to the operator of the recording."""


@cache
def farewell() -> bytes:
    """All that a program is sent that finds no place: a STATUSTEXT with the reason."""
    text = f"{PLACES} programs use this recording already; end one"
    message = dialect.MAVLink_statustext_message(dialect.MAV_SEVERITY_WARNING, text.encode("ascii"))
    return Encoder(*GROUND_STATION).encode(message)


BACKLOG_BYTES: Final = 1 << 18
SEND_BUFFER_BYTES: Final = 1 << 16
READ_BYTES: Final = 1 << 16
# An upload of all parameters is some 10 kB, and few vehicles' links carry more than these limits.
BURST_BYTES: Final = 1 << 16
MOST_BYTES_A_S: Final = 32_000


class _State(Enum):
    CONNECTED = auto()
    LEFT = auto()
    DROPPED = auto()


@dataclass
class _Client:
    """A connection: the bytes that wait to be sent, and the number of bytes that it may still send."""

    sock: socket.socket
    asked_s: float
    state: _State = _State.CONNECTED
    framer: Framer = field(default_factory=Framer)
    backlog: bytearray = field(default_factory=bytearray)
    allowed_bytes: float = BURST_BYTES

    def send(self, raw: bytes) -> None:
        self.backlog += raw
        while self.backlog and self.state is _State.CONNECTED:
            try:
                sent = self.sock.send(self.backlog)
            except BlockingIOError:
                break
            except OSError:
                self.state = _State.LEFT
                break
            del self.backlog[:sent]
        if len(self.backlog) > BACKLOG_BYTES:
            self.state = _State.DROPPED

    def read(self, now_s: float) -> list[Frame]:
        earned = (now_s - self.asked_s) * MOST_BYTES_A_S
        self.allowed_bytes, self.asked_s = min(BURST_BYTES, self.allowed_bytes + earned), now_s
        try:
            data = self.sock.recv(READ_BYTES)
        except BlockingIOError:
            frames = self.framer.hear(b"", now_s)
        except OSError:
            self.state = _State.LEFT
            return []
        else:
            self.allowed_bytes -= len(data)
            frames = self.framer.hear(data, now_s) if data else self.framer.flush()
            self.state = self.state if data else _State.LEFT
        if self.allowed_bytes < 0 or self.framer.counts["skipped"]:
            self.state = _State.DROPPED
            return []
        return frames


class Hub:
    """A listener on `port` of this computer, 0 for any free port, with several clients.

    `tell` is called when a client connects while all places are taken, once until a place is free again. Used by a
    single thread; other threads may read `clients` and `dropped`. Raises LinkError if it can't listen on the port.
    """

    def __init__(self, clock: Clock, port: int = 0) -> None:
        self._clock = clock
        self._clients: list[_Client] = []
        self.dropped = 0
        self.tell: Callable[[str], None] = lambda _: None
        self._warned = False
        self._listener = socket.socket(socket.AF_INET, socket.SOCK_STREAM)
        try:
            self._listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            # Inherited by the clients' sockets: a stalled client shows in its backlog, not in the system's buffer.
            self._listener.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, SEND_BUFFER_BYTES)
            self._listener.bind((LOOPBACK, port))
            self._listener.listen(PLACES)
        except OSError as error:
            self._listener.close()
            raise LinkError(
                f"--hub {port}: can't listen on that port of this computer ({error.strerror}); "
                "stop the program that does, or give another port"
            ) from None
        self._listener.setblocking(False)
        self.address = f"tcp:{LOOPBACK}:{self._listener.getsockname()[1]}"

    @property
    def clients(self) -> int:
        return len(self._clients)

    def broadcast(self, raw: bytes) -> None:
        """Send whole frames to every client."""
        for client in self._clients:
            client.send(raw)
        self._sweep()

    def taken(self) -> list[bytes]:
        """Whole frames that clients sent since the last call; each call also accepts new clients."""
        now_s = self._clock.boot_s()
        frames: list[Frame] = []
        for client in self._clients:
            client.send(b"")
            if client.state is _State.CONNECTED:
                frames += client.read(now_s)
        # Clients that left make room for new clients.
        self._sweep()
        self._accept(now_s)
        return [frame.raw for frame in frames]

    def close(self) -> None:
        """Disconnect all clients and stop listening."""
        for client in self._clients:
            client.sock.close()
        self._clients = []
        self._listener.close()

    def _accept(self, now_s: float) -> None:
        while True:
            try:
                sock, _ = self._listener.accept()
            except OSError:
                return
            sock.setblocking(False)
            with suppress(OSError):
                sock.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            client = _Client(sock, now_s)
            if len(self._clients) < PLACES:
                self._clients.append(client)
                continue
            client.send(farewell())
            sock.close()
            self.dropped += 1
            if not self._warned:
                self._warned = True
                with suppress(OSError):  # as the crew's terminal may have gone
                    self.tell(FULL)

    def _sweep(self) -> None:
        for client in self._clients:
            if client.state is not _State.CONNECTED:
                client.sock.close()
                self.dropped += client.state is _State.DROPPED
        self._clients = [client for client in self._clients if client.state is _State.CONNECTED]
        self._warned = self._warned and len(self._clients) >= PLACES
