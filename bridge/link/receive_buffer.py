"""The system's receive buffer of a datagram socket: set to a large size, and its losses counted.

If datagrams arrive faster than they are read, the system drops those that do not fit, and nobody on the network can
tell that from a loss on the way. Linux reports the drops with each datagram, by SO_RXQ_OVFL (socket(7)).
"""

import socket
import struct
import sys
from contextlib import suppress
from typing import Any, Final

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
