"""TCP: `tcp` connects to a peer, `tcpin` listens and serves one peer at a time."""

import socket

from bridge.errors import LinkError, LinkLost
from bridge.links.addresses import no_listener
from bridge.links.descriptor import DescriptorLink
from bridge.links.link import Link

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
    # A peer whose cable was pulled is silent: probe it, so that its loss is known within about 10 s.
    sock.setsockopt(socket.SOL_SOCKET, socket.SO_KEEPALIVE, 1)
    for option, value in (("TCP_KEEPIDLE", 4), ("TCP_KEEPINTVL", 2), ("TCP_KEEPCNT", 3)):
        if hasattr(socket, option):
            sock.setsockopt(socket.IPPROTO_TCP, getattr(socket, option), value)
    return DescriptorLink(name, sock.fileno(), sock.close)


class TcpServer(Link):
    """A listening link: serves the first peer that connects until it leaves, then the next."""

    def __init__(self, name: str, listener: socket.socket) -> None:
        self.name = name
        self._listener = listener
        self._peer: DescriptorLink | None = None

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
        """The local port."""
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
