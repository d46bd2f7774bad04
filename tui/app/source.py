"""Frames of a link with their arrival times; a lost link is opened again."""

from collections.abc import Callable
from typing import Final, Protocol

from bridge.clock import Clock
from bridge.framing import Frame, Framer
from bridge.link.base import Link
from bridge.link.reconnecting import Aside, Reconnecting

WAIT_S: Final = 0.05
IDLE_FLUSH_S: Final = 0.5


class Source(Protocol):
    """Source of frames, and sender of messages to the vehicle."""

    @property
    def trouble(self) -> str:
        """Why no frames arrive, "" while the link works."""
        ...

    def frames(self) -> list[tuple[float, str, Frame]]:
        """Frames received since the last call, with arrival time and link; waits briefly for the first."""
        ...

    def send(self, data: bytes) -> None:
        """Send all of `data`, or drop it while the link is down."""
        ...

    def close(self) -> None: ...


class LinkSource:
    """One link, opened by `factory` in another thread, and opened again whenever it is lost.

    It keeps the name `name`: a replacement link uses it too, so that no lost link remains in the picture. `refused`
    says what to do if a signed link accepts no frames.
    """

    def __init__(
        self,
        factory: Callable[[], Link],
        name: str,
        clock: Clock,
        refused: Callable[[], str] = lambda: "",
    ) -> None:
        self._clock, self._name, self._refused = clock, name, refused
        self._link = Reconnecting(Aside(factory, name), clock, name)
        self._framer = Framer()
        self._data_s = clock.boot_s()

    @property
    def trouble(self) -> str:
        return self._link.fault or self._refused()

    def frames(self) -> list[tuple[float, str, Frame]]:
        data = self._link.read(WAIT_S)
        now_s = self._clock.boot_s()
        if data:
            self._data_s = now_s
            new_frames = self._framer.feed(data)
        elif now_s - self._data_s > IDLE_FLUSH_S:
            new_frames = self._framer.flush()
        else:
            return []
        return [(now_s, self._name, frame) for frame in new_frames]

    def send(self, data: bytes) -> None:
        self._link.write(data)

    def close(self) -> None:
        self._link.close()


class Listening:
    """Wraps another source and never sends anything."""

    def __init__(self, source: Source) -> None:
        self._source = source

    @property
    def trouble(self) -> str:
        return self._source.trouble

    def frames(self) -> list[tuple[float, str, Frame]]:
        return self._source.frames()

    def send(self, data: bytes) -> None:
        del data

    def close(self) -> None:
        self._source.close()
