"""The base of every link and of a link around another, and a link within a process."""

from abc import ABC, abstractmethod
from collections import deque
from threading import Condition
from typing import TYPE_CHECKING, Final

from bridge.errors import LinkLost

if TYPE_CHECKING:
    from bridge.links.udp import ReceiveBuffer


class Link(ABC):
    """A two-way carrier of bytes, read by one reader only.

    `name` is as a person writes it: `serial:/dev/ttyUSB0:115200`, `udpin:127.0.0.1:14550`. `fault` says why a link
    that reconnects by itself is away, "" while it works. `dropped` counts the writes that this link lost on this
    computer, without those lost by a link inside it, `lost_writes` all of them. `buffer` is the receive buffer of a
    socket of datagrams.
    """

    name: str
    fault: str = ""
    dropped: int = 0
    buffer: "ReceiveBuffer | None" = None

    @property
    def contested(self) -> frozenset[tuple[int, int]]:
        """MAVLink sources as which several peers speak: an order to such a source reaches all of them."""
        return frozenset()

    @property
    def lost_writes(self) -> int:
        return self.dropped

    @abstractmethod
    def read(self, timeout_s: float) -> bytes:
        """Return the bytes that have arrived, waiting up to `timeout_s` for the first; b"" for none.

        Raises LinkLost when the port or the peer has gone.
        """

    @abstractmethod
    def write(self, data: bytes) -> None:
        """Send all of `data`. Raises LinkLost when the port or the peer has gone."""

    @abstractmethod
    def close(self) -> None: ...


class Wrapper(Link):
    """A link around another; peers, buffer and port stay with the inner link."""

    def __init__(self, link: Link) -> None:
        self.name, self.buffer = link.name, link.buffer
        self._link = link

    @property
    def contested(self) -> frozenset[tuple[int, int]]:
        return self._link.contested

    @property
    def lost_writes(self) -> int:
        return self.dropped + self._link.lost_writes

    def write(self, data: bytes) -> None:
        self._link.write(data)

    def close(self) -> None:
        self._link.close()


class _Cable:
    """What both ends share: whether it holds, and the notice of any change."""

    def __init__(self) -> None:
        self.whole = True
        self.changed: Final = Condition()


class MemoryLink(Link):
    """One end of `memory_pair`, for lock-step. Chunks are handed over as they were written, without a copy."""

    def __init__(self, name: str, inbox: deque[bytes], outbox: deque[bytes], cable: _Cable) -> None:
        self.name = name
        self._inbox = inbox
        self._outbox = outbox
        self._cable = cable

    def read(self, timeout_s: float) -> bytes:
        cable = self._cable
        if not self._inbox and timeout_s > 0:
            with cable.changed:
                cable.changed.wait_for(lambda: bool(self._inbox) or not cable.whole, timeout_s)
        if self._inbox:
            return self._inbox.popleft()
        self._check_whole()
        return b""

    def write(self, data: bytes) -> None:
        self._check_whole()
        self._outbox.append(data)
        with self._cable.changed:
            self._cable.changed.notify_all()

    def close(self) -> None:
        self._cable.whole = False
        with self._cable.changed:
            self._cable.changed.notify_all()

    def _check_whole(self) -> None:
        if not self._cable.whole:
            raise LinkLost("the other end was closed; open a new pair", self.name)


def memory_pair() -> tuple[MemoryLink, MemoryLink]:
    """Return two ends that are joined to each other."""
    there, back = deque[bytes](), deque[bytes]()
    cable = _Cable()
    return MemoryLink("memory:a", back, there, cable), MemoryLink("memory:b", there, back, cable)
