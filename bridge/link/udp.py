"""UDP: `udpin` binds and learns its peers from what they send, `udpout` sends to one peer."""

import select
import socket

from bridge.errors import LinkError, LinkLost
from bridge.link.addresses import no_listener

LARGEST_DATAGRAM = 65535
MOST_PEERS = 8

Address = tuple[str, int]


class UdpLink:
    """A datagram socket; each `read` gives one datagram. Without `peer` it answers all that spoke to it.

    It is never connected: a peer that does not listen yet then raises no error.
    """

    def __init__(self, name: str, sock: socket.socket, peer: Address | None) -> None:
        self.name = name
        self._socket = sock
        self._peers: list[Address] = [] if peer is None else [peer]
        self._learns = peer is None
        self._socket.setblocking(False)

    def read(self, timeout_s: float) -> bytes:
        try:
            ready, _, _ = select.select([self._socket], [], [], max(0.0, timeout_s))
            if not ready:
                return b""
            data, sender = self._socket.recvfrom(LARGEST_DATAGRAM)
        except BlockingIOError:
            return b""
        except (OSError, ValueError) as error:
            raise self._lost(error) from None
        if self._learns:
            self._learn((sender[0], sender[1]))
        elif (sender[0], sender[1]) not in self._peers:
            return b""
        return data

    def write(self, data: bytes) -> None:
        for peer in self._peers:
            try:
                self._socket.sendto(data, peer)
            except BlockingIOError:
                continue
            except (OSError, ValueError) as error:
                if not self._learns:
                    raise self._lost(error) from None

    def close(self) -> None:
        self._socket.close()

    @property
    def port(self) -> int:
        """The local port."""
        return int(self._socket.getsockname()[1])

    def _learn(self, peer: Address) -> None:
        if peer not in self._peers:
            self._peers = [*self._peers[1 - MOST_PEERS :], peer]

    def _lost(self, error: OSError | ValueError) -> LinkLost:
        reason = getattr(error, "strerror", None) or str(error)
        return LinkLost(
            f"{self.name}: the network does not carry it ({reason}); check the address and the network"
        )


def open_udpin(host: str, port: int) -> UdpLink:
    """A socket bound to `host`. Raises LinkError where the address is not this computer's, or is taken."""
    name = f"udpin:{host}:{port}"
    sock = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    try:
        sock.bind((host, port))
    except OSError as error:
        sock.close()
        raise no_listener(name, host, port, error) from None
    return UdpLink(name, sock, None)


def open_udpout(host: str, port: int) -> UdpLink:
    """A socket that speaks to one peer, which need not listen yet. Raises LinkError for an unknown host."""
    name = f"udpout:{host}:{port}"
    try:
        address = socket.gethostbyname(host)
    except OSError as error:
        raise LinkError(f"{name}: the host '{host}' is unknown ({error.strerror}); check the name") from None
    return UdpLink(name, socket.socket(socket.AF_INET, socket.SOCK_DGRAM), (address, port))
