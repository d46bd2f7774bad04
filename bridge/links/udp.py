"""UDP: `udpin` binds and learns its peers from the datagrams they send, `udpout` sends to one peer.

If datagrams arrive faster than they are read, the system drops those that do not fit, and nobody on the network can
tell that from a loss on the way. Linux reports the drops with each datagram, by SO_RXQ_OVFL (socket(7)).
"""

import select
import socket
import struct
import sys
from collections import OrderedDict, deque
from contextlib import suppress
from dataclasses import dataclass, field
from typing import Any, Final

from bridge.errors import LinkError, LinkLost
from bridge.links.addresses import no_listener
from bridge.links.link import Link

# Over a second of 10 000 short datagrams a second, each with 768 B of the system's own (Linux doubles this size).
ASKED_BYTES: Final = 4 << 20
LARGEST_DATAGRAM: Final = 65535
SO_RXQ_OVFL: Final = 40
ROUND: Final = 1 << 32
COUNTER: Final = struct.Struct("=I")


class ReceiveBuffer:
    """Buffer of one socket. `given_bytes` is the size granted of `asked_bytes`, `dropped` the datagrams it lost.

    A drop becomes known with the next datagram that fits. If the system does not count drops, `dropped` stays 0.
    """

    def __init__(self, sock: socket.socket, asked_bytes: int = ASKED_BYTES) -> None:
        self.asked_bytes = asked_bytes
        self.dropped = 0
        self._socket = sock
        self._counted = 0
        self._room = 0
        with suppress(OSError):
            sock.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, asked_bytes)
        self.given_bytes = sock.getsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF)
        if sys.platform == "linux":
            # Linux doubles the requested size for its own needs, and reports the double.
            self.given_bytes //= 2
            with suppress(OSError):
                sock.setsockopt(socket.SOL_SOCKET, SO_RXQ_OVFL, 1)
                self._room = socket.CMSG_SPACE(COUNTER.size)

    def receive(self) -> tuple[bytes, Any]:
        """Return the next datagram and its sender's address. Raises BlockingIOError if there is none, OSError."""
        if not self._room:
            return self._socket.recvfrom(LARGEST_DATAGRAM)
        data, ancillary, _, sender = self._socket.recvmsg(LARGEST_DATAGRAM, self._room)
        for level, kind, value in ancillary:
            if level == socket.SOL_SOCKET and kind == SO_RXQ_OVFL and len(value) == COUNTER.size:
                (counted,) = COUNTER.unpack(value)
                self.dropped += (counted - self._counted) % ROUND
                self._counted = counted
        return data, sender

    @property
    def words(self) -> str:
        """Say who lost datagrams and what to do; "" if none were lost on this computer."""
        if not self.dropped:
            return ""
        lost = f"this computer was too slow and lost {self.dropped} datagrams itself, not the link"
        if self.given_bytes >= self.asked_bytes:
            return f"{lost}; end other programs on it, or let the vehicle send less"
        return (
            f"{lost}; its buffer has {self.given_bytes // 1024} of {self.asked_bytes // 1024} KiB asked for: "
            f"end other programs, or run `sudo sysctl -w net.core.rmem_max={self.asked_bytes}` and record again"
        )


MAVLINK_1, MAVLINK_2 = 0xFE, 0xFD
MOST_A_READ = 256  # datagrams: everything else waits for at most this many
MOST_PEERS = 8
MOST_SPEAKERS = 256
LONG_ALONE = 200  # datagrams of one peer in a row, after which it counts as the only peer of its source

Address = tuple[str, int]
Source = tuple[int, int]


@dataclass
class _Speaker:
    """The peers that speak as one MAVLink source.

    `peer` spoke last, `before` are the peers that spoke before it, and `alone` counts the datagrams of `peer` since.
    """

    peer: Address
    before: deque[Address] = field(default_factory=lambda: deque(maxlen=MOST_PEERS))
    contested: bool = False
    alone: int = 0

    def heard(self, peer: Address) -> None:
        if peer == self.peer:
            self.alone += 1
            if self.alone > LONG_ALONE:
                self.before.clear()
                self.contested = False
            return
        # A restarted program gets another port and never comes back to its old one.
        self.contested = self.contested or peer in self.before
        self.before.append(self.peer)
        self.peer, self.alone = peer, 0


def source_of(datagram: bytes) -> Source | None:
    """Return the (system, component) of a datagram's first MAVLink frame, by its header alone; None for no frame."""
    if len(datagram) > 6 and datagram[0] == MAVLINK_2:
        return datagram[5], datagram[6]
    return (datagram[3], datagram[4]) if len(datagram) > 4 and datagram[0] == MAVLINK_1 else None


class UdpLink(Link):
    """A datagram socket; `read` returns all waiting datagrams. Without `peer` it answers all peers that spoke.

    Of those it answers the `MOST_PEERS` heard last, and no peer that never began a datagram with a MAVLink frame. The
    socket is never connected, so that a peer that does not listen yet raises no error. `buffer` counts the datagrams
    that this computer lost.
    """

    def __init__(self, name: str, sock: socket.socket, peer: Address | None) -> None:
        self.name = name
        self.buffer: ReceiveBuffer = ReceiveBuffer(sock)
        self._socket = sock
        self._peers: list[Address] = [] if peer is None else [peer]
        self._learns = peer is None
        # In the order in which they were heard last.
        self._speakers: OrderedDict[Source, _Speaker] = OrderedDict()
        self._socket.setblocking(False)

    def read(self, timeout_s: float) -> bytes:
        try:
            ready, _, _ = select.select([self._socket], [], [], max(0.0, timeout_s))
            if not ready:
                return b""
        except (OSError, ValueError) as error:
            raise self._lost(error) from None
        return b"".join(self._waiting())

    def write(self, data: bytes) -> None:
        for peer in self._peers:
            try:
                self._socket.sendto(data, peer)
            except BlockingIOError:
                self.dropped += 1
            except (OSError, ValueError) as error:
                if not self._learns:
                    raise self._lost(error) from None

    def close(self) -> None:
        self._socket.close()

    @property
    def port(self) -> int:
        return int(self._socket.getsockname()[1])

    @property
    def contested(self) -> frozenset[Source]:
        return frozenset(source for source, speaker in self._speakers.items() if speaker.contested)

    def _waiting(self) -> list[bytes]:
        """Return the waiting datagrams of the peers that may speak."""
        datagrams: list[bytes] = []
        for _ in range(MOST_A_READ):
            try:
                data, sender = self.buffer.receive()
            except BlockingIOError:
                break
            except (OSError, ValueError) as error:
                # Datagrams before the fault are not lost; a fault that stays is met by the next read.
                if datagrams:
                    break
                raise self._lost(error) from None
            peer = (sender[0], sender[1])
            if self._learns:
                self._learn(peer, data)
            elif peer not in self._peers:
                continue
            datagrams.append(data)
        return datagrams

    def _learn(self, peer: Address, data: bytes) -> None:
        source = source_of(data)
        if source is not None:
            self._speakers.setdefault(source, _Speaker(peer)).heard(peer)
            self._speakers.move_to_end(source)
            if len(self._speakers) > MOST_SPEAKERS:
                self._speakers.popitem(last=False)
        if source is not None or peer in self._peers:
            others = [known for known in self._peers if known != peer]
            self._peers = [*others[1 - MOST_PEERS :], peer]

    def _lost(self, error: OSError | ValueError) -> LinkLost:
        reason = getattr(error, "strerror", None) or str(error)
        return LinkLost(
            f"the network does not carry it ({reason}); check the address and the network", self.name
        )


def open_udpin(host: str, port: int) -> UdpLink:
    """Open a socket bound to `host`. Raises LinkError if the address is not this computer's, or is taken."""
    name = f"udpin:{host}:{port}"
    sock = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    try:
        sock.bind((host, port))
    except OSError as error:
        sock.close()
        raise no_listener(name, host, port, error) from None
    return UdpLink(name, sock, None)


def open_udpout(host: str, port: int) -> UdpLink:
    """Open a socket that speaks to one peer, which need not listen yet. Raises LinkError for an unknown host."""
    name = f"udpout:{host}:{port}"
    try:
        family, peer = _resolved(host, port)
    except OSError as error:
        raise LinkError(f"the host '{host}' is unknown ({error.strerror}); check the name", name) from None
    sock = socket.socket(family, socket.SOCK_DGRAM)
    # Without a route to the peer yet, the system chooses the address with the first outgoing datagram.
    with suppress(OSError):
        sock.bind((_own_towards(family, peer), 0))
    return UdpLink(name, sock, peer)


def _resolved(host: str, port: int) -> tuple[int, Address]:
    """Return family and address of a peer, IPv4 if it has both."""
    addresses = socket.getaddrinfo(host, port, type=socket.SOCK_DGRAM)
    family, *_, address = min(addresses, key=lambda entry: entry[0] != socket.AF_INET)
    return family, (str(address[0]), port)


def _own_towards(family: int, peer: Address) -> str:
    """Return this computer's address on the way to `peer`; sends nothing.

    A socket bound to it can't be reached from other networks.
    """
    with socket.socket(family, socket.SOCK_DGRAM) as probe:
        probe.connect(peer)
        return str(probe.getsockname()[0])
