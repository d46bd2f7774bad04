"""A link without a key: it takes what comes, and the crew is told where the other side signs."""

from collections.abc import Callable
from typing import Final

from bridge.framing import Framer
from bridge.link.base import Link
from bridge.signing.frame import is_signed

MOST_LOOKED_AT: Final = 200
"""Frames after which nobody looks any more: who signs signs each."""


class KeylessLink:
    """Passes all on as it is; `tell` hears once, in a sentence, of a system that signs what it sends."""

    def __init__(self, link: Link, tell: Callable[[str], None]) -> None:
        self.name = link.name
        self._link, self._tell = link, tell
        self._framer: Framer | None = Framer()
        self._looked_at = 0

    @property
    def contested(self) -> frozenset[tuple[int, int]]:
        """What the link inside knows of sources as which several peers speak."""
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
