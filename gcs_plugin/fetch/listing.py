"""The vehicle's list of its segments, asked for piece by piece and believed as far as it can be true."""

from typing import Final

from bridge.ftp.packet import Packet
from bridge.ring.segments import Segment, segment_named

Listing = list[tuple[Segment, int]]
"""Segments with their sizes in bytes."""

MOST_SEGMENTS: Final = 100_000
MOST_BYTES: Final = 0xFFFFFFFF
"""MAVLink FTP tells an offset in 32 bits: of a longer file nobody could ask for the end."""
_SIZE_DIGITS: Final = 10


class Listed:
    """What was listed so far; `index` is that of the entry to ask for next."""

    def __init__(self) -> None:
        self.index = 0
        self._sizes: dict[Segment, int] = {}

    @property
    def is_too_long(self) -> bool:
        """Whether it lists more than any ring holds: then nobody knows whether it ends."""
        return len(self._sizes) > MOST_SEGMENTS

    def hear(self, packet: Packet) -> bool:
        """An answer that grants the next entries came. Whether it brought a segment that was not listed yet."""
        if packet.offset != self.index:
            return False
        before = len(self._sizes)
        entries = [entry for entry in packet.data.split(b"\0") if entry]
        self.index += len(entries)
        for entry in entries:
            name, _, size = entry[1:].decode("ascii", "replace").partition("\t")
            segment = segment_named(name)
            if (
                segment is not None
                and len(size) <= _SIZE_DIGITS
                and size.isdecimal()
                and int(size) <= MOST_BYTES
            ):
                self._sizes[segment] = int(size)
        return len(self._sizes) > before

    def listing(self) -> Listing:
        """The segments, oldest first."""
        return sorted(self._sizes.items())
