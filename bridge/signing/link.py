"""Links with and without a key: a signed link hears only senders with the key; the other warns if its peer signs."""

from collections.abc import Callable
from typing import Final

from bridge.clock import Clock
from bridge.errors import FrameError
from bridge.links.link import Link, Wrapper
from bridge.signing.gate import Gate, is_signed
from bridge.wire.framing import Framer, measure

MOST_LOOKED_AT: Final = 200
"""Number of frames that are examined: a system that signs does so in each of its frames."""


class KeylessLink(Wrapper):
    """Passes all bytes on unchanged. Calls `tell` once, with a sentence, if a system signs its frames."""

    def __init__(self, link: Link, tell: Callable[[str], None]) -> None:
        super().__init__(link)
        self._tell = tell
        self._framer: Framer | None = Framer()
        self._looked_at = 0

    def read(self, timeout_s: float) -> bytes:
        data = self._link.read(timeout_s)
        if self._framer is not None and data:
            self._look(self._framer, data)
        return data

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


LARGEST_WRITE: Final = 1400  # signed frames must also fit a datagram on every network
MOST_REFUSED_A_READ: Final = 64
PAUSE_S: Final = 0.5


class SignedLink(Wrapper):
    """Checks incoming frames and passes them on without their signature; signs outgoing frames.

    Incoming bytes that are no frame are not passed on. Outgoing bytes that are no frame, and frames that can't be
    signed, are not sent; `dropped` counts these.
    """

    def __init__(self, link: Link, gate: Gate, clock: Clock) -> None:
        super().__init__(link)
        self._gate, self._clock = gate, clock
        self._framer = Framer()
        self._heard_s = clock.boot_s()

    def read(self, timeout_s: float) -> bytes:
        # A stranger's datagrams must not delay those of the vehicle.
        for _ in range(MOST_REFUSED_A_READ):
            data = self._link.read(timeout_s)
            admitted = self._admitted(data)
            if admitted or not data:
                break
            timeout_s = 0.0
        self._gate.look()
        return admitted

    def write(self, data: bytes) -> None:
        batch = b""
        place = 0
        while place < len(data):
            size = measure(data, place)
            if size <= 0 or place + size > len(data):
                self.dropped += 1
                break
            out = self._signed(data[place : place + size])
            if len(batch) + len(out) > LARGEST_WRITE:
                self._link.write(batch)
                batch = b""
            batch += out
            place += size
        if batch:
            self._link.write(batch)

    def close(self) -> None:
        self._gate.close()
        self._link.close()

    def _admitted(self, data: bytes) -> bytes:
        now_s = self._clock.boot_s()
        if data:
            self._heard_s = now_s
            frames = self._framer.feed(data)
        elif now_s - self._heard_s >= PAUSE_S:
            frames = self._framer.flush()
        else:
            return b""
        return b"".join(self._gate.admit(frame) for frame in frames)

    def _signed(self, raw: bytes) -> bytes:
        try:
            return self._gate.out(raw)
        except FrameError:
            self.dropped += 1
            return b""
