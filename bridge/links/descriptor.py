"""Links over a file descriptor: serial ports (8N1, held by one program only), TCP.

`tcp` connects to a peer, `tcpin` listens and serves one peer at a time.
"""

import errno
import os
import select
import socket
import termios
from collections.abc import Callable
from typing import Any

import serial

from bridge.errors import LinkError, LinkLost
from bridge.links.addresses import DEFAULT_BAUD, no_listener
from bridge.links.link import Link

READ_BYTES = 65536
BACKLOG_BYTES = 65536
LEAST_BACKLOG_BYTES = 4096
BITS_A_BYTE = 10
"""With start bit and stop bit."""


class DescriptorLink(Link):
    """Reads and writes a non-blocking descriptor; `release` closes the object that owns it.

    A peer that takes no bytes never stalls the writer: unsent bytes wait, up to `most_waiting`. Beyond that, new data
    is dropped whole and counted in `dropped`.
    """

    def __init__(
        self, name: str, descriptor: int, release: Callable[[], None], most_waiting: int = BACKLOG_BYTES
    ) -> None:
        self.name = name
        self._most_waiting = most_waiting
        self._descriptor = descriptor
        self._release = release
        self._backlog = b""
        # Reused for each read: a new buffer every time would fragment the memory of the reading thread.
        self._read_into = memoryview(bytearray(READ_BYTES))
        os.set_blocking(descriptor, False)

    def read(self, timeout_s: float) -> bytes:
        self._check_open()
        try:
            self._send_backlog()
        except OSError:
            # A peer that accepts no more bytes may have said why: read that first, and then its end.
            self._backlog = b""
        try:
            ready, _, _ = select.select([self._descriptor], [], [], max(0.0, timeout_s))
            if not ready:
                return b""
            count = os.readv(self._descriptor, [self._read_into])
        except BlockingIOError:
            return b""
        except (OSError, ValueError) as error:
            raise self._lost(error) from None
        if not count:
            raise LinkLost("the other side has gone; plug it in or start it again", self.name)
        return bytes(self._read_into[:count])

    def write(self, data: bytes) -> None:
        self._check_open()
        if len(self._backlog) + len(data) > self._most_waiting:
            self.dropped += 1
        else:
            self._backlog += data
        try:
            self._send_backlog()
        except (OSError, ValueError) as error:
            raise self._lost(error) from None

    def close(self) -> None:
        if self._descriptor >= 0:
            self._descriptor = -1
            self._release()

    def _send_backlog(self) -> None:
        while self._backlog:
            try:
                sent = os.write(self._descriptor, self._backlog)
            except BlockingIOError:
                return
            self._backlog = self._backlog[sent:]

    def _check_open(self) -> None:
        if self._descriptor < 0:
            raise LinkLost("is closed; open it again", self.name)

    def _lost(self, error: OSError | ValueError) -> LinkLost:
        reason = getattr(error, "strerror", None) or str(error)
        return LinkLost(f"the other side has gone ({reason}); plug it in or start it again", self.name)


def open_serial(port: str, baud: int = DEFAULT_BAUD) -> DescriptorLink:
    """Open the serial port `port`. Raises LinkError if it is absent, busy, forbidden or no serial port.

    What it can't carry in a second is dropped: what waited longer would pass for new on the other side.
    """
    name = f"serial:{port}:{baud}"
    try:
        opened: Any = serial.Serial(port, baud, timeout=0, exclusive=True)
    except serial.SerialException as error:
        raise LinkError(_reason(port, error), name) from None
    except (ValueError, OverflowError) as error:
        raise LinkError(f"can't be set up ({error}); check the baud rate", name) from None
    except OSError as error:
        raise LinkError(f"can't be opened ({error.strerror}); check the port", name) from None
    except termios.error as error:  # it was unplugged just then
        raise LinkError(f"can't be set up ({error.args[-1]}); check the cable", name) from None
    return DescriptorLink(name, opened.fileno(), opened.close, max(baud // BITS_A_BYTE, LEAST_BACKLOG_BYTES))


def _reason(port: str, error: serial.SerialException) -> str:
    code = error.errno
    if code == errno.ENOENT:
        return f"there is no port {port}; check the cable and the name (ls /dev/tty*)"
    if code == errno.EACCES:
        return "permission denied; join the group that owns the port (often `dialout`) and log in again"
    if code in (errno.EBUSY, errno.EAGAIN):
        return "another program holds the port; stop that program, or give another port"
    return f"can't be opened ({error}); check that it is a serial port"


CONNECT_S = 2.0  # plus the longest pause between tries: a device is back 3 s after its cable


def open_tcp(host: str, port: int) -> DescriptorLink:
    """Connect to a peer. Raises LinkError if nobody answers there."""
    name = f"tcp:{host}:{port}"
    try:
        sock = socket.create_connection((host, port), CONNECT_S)
    except ConnectionRefusedError:
        raise LinkError("refused, nobody listens there; start the other side first", name) from None
    except OSError as error:
        reason = error.strerror or "no answer"
        raise LinkError(f"can't connect ({reason}); check the address and the network", name) from None
    return _connection(name, sock)


def _connection(name: str, sock: socket.socket) -> DescriptorLink:
    sock.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
    # A peer whose cable was pulled is silent: probe it, so that its loss is known within about 10 s. The system sends
    # no probe while data wait for the peer, and would repeat these for a quarter of an hour; with a limit, a peer that
    # takes nothing for 10 s is lost as well.
    sock.setsockopt(socket.SOL_SOCKET, socket.SO_KEEPALIVE, 1)
    options = (("TCP_KEEPIDLE", 4), ("TCP_KEEPINTVL", 2), ("TCP_KEEPCNT", 3), ("TCP_USER_TIMEOUT", 10_000))
    for option, value in options:
        if hasattr(socket, option):
            sock.setsockopt(socket.IPPROTO_TCP, getattr(socket, option), value)
    return DescriptorLink(name, sock.fileno(), sock.close)


class TcpServer(Link):
    """A listening link: serves the first peer that connects until it leaves, then the next."""

    def __init__(self, name: str, listener: socket.socket) -> None:
        self.name = name
        self._listener = listener
        self._peer: DescriptorLink | None = None

    @property
    def lost_writes(self) -> int:
        return self.dropped + (0 if self._peer is None else self._peer.lost_writes)

    def read(self, timeout_s: float) -> bytes:
        if self._peer is None:
            self._accept(timeout_s)
            if self._peer is None:
                return b""
        try:
            return self._peer.read(timeout_s)
        except LinkLost:
            self._drop()
            return b""

    def write(self, data: bytes) -> None:
        if self._peer is None:
            self._accept(0.0)
        if self._peer is None:
            return
        try:
            self._peer.write(data)
        except LinkLost:
            self._drop()

    def close(self) -> None:
        self._drop()
        self._listener.close()

    @property
    def port(self) -> int:
        return int(self._listener.getsockname()[1])

    def _accept(self, timeout_s: float) -> None:
        try:
            self._listener.settimeout(max(0.0, timeout_s))
            sock, _ = self._listener.accept()
        except (BlockingIOError, TimeoutError):
            return
        except OSError as error:
            raise LinkLost(f"no longer listens ({error.strerror}); open it again", self.name) from None
        self._peer = _connection(self.name, sock)

    def _drop(self) -> None:
        if self._peer is not None:
            self.dropped += self._peer.lost_writes
            self._peer.close()
            self._peer = None


def open_tcpin(host: str, port: int) -> TcpServer:
    """Listen on `host`. Raises LinkError if the address is not this computer's, or is taken."""
    name = f"tcpin:{host}:{port}"
    listener = socket.socket(socket.AF_INET, socket.SOCK_STREAM)
    listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
    try:
        listener.bind((host, port))
        listener.listen(1)
    except OSError as error:
        listener.close()
        raise no_listener(name, host, port, error) from None
    return TcpServer(name, listener)
