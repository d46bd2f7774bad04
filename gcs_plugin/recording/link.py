"""A link of a recording, which is opened again when it is lost."""

from collections.abc import Callable
from typing import Final

from bridge.clock import Clock
from bridge.errors import LinkError
from bridge.links.link import Link
from bridge.links.reconnecting import Aside
from bridge.links.udp import ReceiveBuffer
from bridge.wire.framing import Frame, Framer

REOPEN_EVERY_S: Final = 1.0
WARN_EVERY_S: Final = 10.0


class RecordedLink:
    """A link that survives its loss.

    `reopen` opens the link again by its name; without it, a lost link stays lost. `say` is called with a level and a
    sentence.
    """

    def __init__(
        self,
        link: Link,
        clock: Clock,
        say: Callable[[str, str], None],
        reopen: Callable[[str], Link] | None = None,
    ) -> None:
        self.name = name = link.name
        self._link: Link | None = link
        self._clock, self._say = clock, say
        self._framer = Framer()
        self._again = None if reopen is None else Aside(lambda: reopen(name), name)
        self._next_try_s = 0.0
        self._lost_before = self._warned_of = 0
        self._warn_s = clock.boot_s()

    @property
    def is_there(self) -> bool:
        """Whether the link is open, as far as known."""
        return self._link is not None

    @property
    def lost_here(self) -> int:
        """Number of datagrams that this computer dropped since it did not read them in time."""
        buffer = self._buffer
        return self._lost_before + (buffer.dropped if buffer else 0)

    def look(self) -> None:
        """Warn of datagrams that this computer dropped, at most every WARN_EVERY_S."""
        now_s = self._clock.boot_s()
        if self.lost_here > self._warned_of and now_s >= self._warn_s:
            self._warned_of, self._warn_s = self.lost_here, now_s + WARN_EVERY_S
            words = self._buffer.words if self._buffer else ""
            self._say(
                "warning", f"{self.name}: {words or f'this computer lost {self._warned_of} datagrams itself'}"
            )

    def read(self, timeout_s: float) -> list[Frame]:
        """Read frames, waiting up to `timeout_s` for bytes; of a link that was lost, those that had come before."""
        link = self._link or self._reopened()
        if link is None:
            return self.flush()
        try:
            data = link.read(timeout_s)
        except LinkError as error:
            self._lose(error)
            return []
        return self._framer.hear(data, self._clock.boot_s())

    def flush(self) -> list[Frame]:
        """Frames in the bytes left over by the framer."""
        return self._framer.flush()

    def send(self, raw: bytes) -> None:
        """Send all of `raw`; it is discarded while the link is lost."""
        if self._link is None:
            return
        try:
            self._link.write(raw)
        except LinkError as error:
            self._lose(error)

    def close(self) -> None:
        if self._link is not None:
            self._link.close()

    @property
    def _buffer(self) -> ReceiveBuffer | None:
        return self._link.buffer if self._link is not None else None

    def _lose(self, error: LinkError) -> None:
        self._say("error", str(error))
        self.close()
        self._lost_before = self.lost_here
        self._link = None
        self._next_try_s = self._clock.boot_s() + REOPEN_EVERY_S

    def _reopened(self) -> Link | None:
        if self._again is None or self._clock.boot_s() < self._next_try_s:
            return None
        self._next_try_s = self._clock.boot_s() + REOPEN_EVERY_S
        try:
            self._link = self._again()
        except LinkError:
            return None
        self._say("info", f"{self.name} is back")
        return self._link
