"""The system's buffer of a datagram socket: asked to be large, read in one go, and what did not fit counted.

Where datagrams come faster than they are read, the system drops what does not fit, and nobody on the network can
tell it from a loss on the way. Linux tells of it with each datagram, by SO_RXQ_OVFL (socket(7)).
"""

import socket
import struct
import sys
from contextlib import suppress
from typing import Any, Final

ASKED_BYTES: Final = (
    4 << 20
)  # a second and more of 10 000 short datagrams a second, each with the system's own 768 B
LARGEST_DATAGRAM: Final = 65535
SO_RXQ_OVFL: Final = 40
ROUND: Final = 1 << 32
COUNTER: Final = struct.Struct("=I")


class ReceiveBuffer:
    """Of one socket. `given_bytes` is what the system let have of `asked_bytes`, `dropped` the datagrams that it lost.

    A drop is known with the next datagram that did fit. Where the system does not count, `dropped` stays 0.
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
            # Linux doubles what is asked for, and tells the double, for its own needs.
            self.given_bytes //= 2
            with suppress(OSError):
                sock.setsockopt(socket.SOL_SOCKET, SO_RXQ_OVFL, 1)
                self._room = socket.CMSG_SPACE(COUNTER.size)

    def receive(self) -> tuple[bytes, Any]:
        """The next datagram and its sender's address. Raises BlockingIOError for none, OSError."""
        if not self._room:
            return self._socket.recvfrom(LARGEST_DATAGRAM)
        data, told, _, sender = self._socket.recvmsg(LARGEST_DATAGRAM, self._room)
        for level, kind, value in told:
            if level == socket.SOL_SOCKET and kind == SO_RXQ_OVFL and len(value) == COUNTER.size:
                (counted,) = COUNTER.unpack(value)
                self.dropped += (counted - self._counted) % ROUND
                self._counted = counted
        return data, sender

    @property
    def words(self) -> str:
        """Who lost what, and what to do; "" where nothing was lost here."""
        if not self.dropped:
            return ""
        lost = f"this computer was too slow and lost {self.dropped} datagrams itself, not the link"
        if self.given_bytes >= self.asked_bytes:
            return f"{lost}; end other programs on it, or let the vehicle send less"
        return (
            f"{lost}; its buffer has {self.given_bytes // 1024} of {self.asked_bytes // 1024} KiB asked for: "
            f"end other programs, or run `sudo sysctl -w net.core.rmem_max={self.asked_bytes}` and record again"
        )
