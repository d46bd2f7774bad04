"""Collect the vehicle's list of its segments, requested piece by piece, and ignore entries that can't be true."""

from typing import Final

from bridge.ftp.packet import Packet
from bridge.ring.segments import Segment, segment_named

Listing = list[tuple[Segment, int]]
"""Segments with their sizes in bytes."""

MOST_SEGMENTS: Final = 100_000
MOST_BYTES: Final = 0xFFFFFFFF
"""MAVLink FTP states an offset in 32 bits, so the end of a longer file can't be requested."""
_SIZE_DIGITS: Final = 10


class Listed:
    """The entries listed so far; `index` is the index of the next entry to request."""

    def __init__(self) -> None:
        self.index = 0
        self._sizes: dict[Segment, int] = {}

    @property
    def is_too_long(self) -> bool:
        """Whether the list is longer than any ring's, so that it may never end."""
        return len(self._sizes) > MOST_SEGMENTS

    def hear(self, packet: Packet) -> bool:
        """Take an answer with the next entries. Return whether it brought a segment that was not listed yet."""
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
        """Return the segments, oldest first."""
        return sorted(self._sizes.items())
