"""The interface of every link."""

from typing import Protocol


class Link(Protocol):
    """A two-way carrier of bytes, read by one reader only."""

    @property
    def name(self) -> str:
        """Name as a person writes it: `serial:/dev/ttyUSB0:115200`, `udpin:127.0.0.1:14550`."""
        ...

    def read(self, timeout_s: float) -> bytes:
        """Return the bytes that have arrived, waiting up to `timeout_s` for the first; b"" for none.

        Raises LinkLost when the port or the peer has gone.
        """
        ...

    def write(self, data: bytes) -> None:
        """Send all of `data`. Raises LinkLost when the port or the peer has gone."""
        ...

    def close(self) -> None: ...
