"""A link without a key: it accepts every frame, and the crew gets a warning if the other side signs."""

from collections.abc import Callable
from typing import Final

from bridge.framing import Framer
from bridge.link.base import Link
from bridge.signing.frame import is_signed

MOST_LOOKED_AT: Final = 200
"""Number of frames that are examined: a system that signs does so in each of its frames."""


class KeylessLink:
    """Passes all bytes on unchanged. Calls `tell` once, with a sentence, if a system signs its frames."""

    def __init__(self, link: Link, tell: Callable[[str], None]) -> None:
        self.name = link.name
        self._link, self._tell = link, tell
        self._framer: Framer | None = Framer()
        self._looked_at = 0

    @property
    def contested(self) -> frozenset[tuple[int, int]]:
        """Sources as which several peers speak, as known to the wrapped link."""
        return getattr(self._link, "contested", frozenset())

    def read(self, timeout_s: float) -> bytes:
        data = self._link.read(timeout_s)
        if self._framer is not None and data:
            self._look(self._framer, data)
        return data

    def write(self, data: bytes) -> None:
        self._link.write(data)

    def close(self) -> None:
        self._link.close()

    def _look(self, framer: Framer, data: bytes) -> None:
        for frame in framer.feed(data):
            self._looked_at += 1
            if is_signed(frame.raw):
                self._framer = None
                self._tell(
                    f"{self.name}: system {frame.system} signs what it sends, and may refuse all that comes from here, "
                    "since this side has no key; give it the same one with --sign-key"
                )
                return
        if self._looked_at >= MOST_LOOKED_AT:
            self._framer = None
