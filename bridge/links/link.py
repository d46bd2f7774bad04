"""The base of every link, and of a link around another."""

from abc import ABC, abstractmethod
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from bridge.links.udp import ReceiveBuffer


class Link(ABC):
    """A two-way carrier of bytes, read by one reader only.

    `name` is as a person writes it: `serial:/dev/ttyUSB0:115200`, `udpin:127.0.0.1:14550`. `fault` says why a link
    that reconnects by itself is away, "" while it works. `dropped` counts the writes that were lost on this computer.
    `buffer` is the receive buffer of a socket of datagrams.
    """

    name: str
    fault: str = ""
    dropped: int = 0
    buffer: "ReceiveBuffer | None" = None

    @property
    def contested(self) -> frozenset[tuple[int, int]]:
        """MAVLink sources as which several peers speak: an order to such a source reaches all of them."""
        return frozenset()

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
    """A link around another, which knows the peers and the buffer and closes the port."""

    def __init__(self, link: Link) -> None:
        self.name, self.buffer = link.name, link.buffer
        self._link = link

    @property
    def contested(self) -> frozenset[tuple[int, int]]:
        return self._link.contested

    def write(self, data: bytes) -> None:
        self._link.write(data)

    def close(self) -> None:
        self._link.close()
