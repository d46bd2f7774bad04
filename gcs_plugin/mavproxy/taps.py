# SPDX-License-Identifier: GPL-3.0-or-later
"""Listen in on MAVProxy's links: every byte that each link reads and writes, in order.

MAVProxy does not pass on to its modules the messages it sends, the link a message came on, or frames that it doesn't
know or takes for delayed. The `recv` and `write` of its links see all of these.
"""

from collections import deque
from collections.abc import Sequence
from typing import Any, Final

from bridge.framing import Frame, Framer

PAUSE_S: Final = 0.5
MOST_WAITING: Final = 10_000
"""Chunks kept until the next `take`: half a minute of the busiest link."""


class Tap:
    """A link of MAVProxy, with the data that passed since the last call; a `Link` only by its name."""

    def __init__(self, connection: Any) -> None:
        self.connection = connection
        self.name: str = str(getattr(connection, "address", "MAVProxy's link"))
        self._chunks: deque[tuple[bool, bytes]] = deque(maxlen=MOST_WAITING)
        self._framers = {False: Framer(), True: Framer()}
        self._last_s = 0.0
        self._recv, self._write = connection.recv, connection.write
        connection.recv, connection.write = self._read_through, self._write_through

    def remove(self) -> None:
        """Restore the link's own methods."""
        for name, ours in (("recv", self._read_through), ("write", self._write_through)):
            # If someone wrapped the link after us, their wrapper keeps working through ours.
            if getattr(self.connection, name) == ours:
                delattr(self.connection, name)

    def take(self, now_s: float) -> list[tuple[bool, Frame]]:
        """Frames since the last call, in the order in which they passed; True for a frame that was sent."""
        frames = []
        if self._chunks:
            self._last_s = now_s
        elif now_s - self._last_s >= PAUSE_S:
            frames += [(sent, frame) for sent, framer in self._framers.items() for frame in framer.flush()]
        while self._chunks:
            sent, data = self._chunks.popleft()
            frames += [(sent, frame) for frame in self._framers[sent].feed(data)]
        return frames

    def read(self, timeout_s: float) -> bytes:
        """Return nothing: `take` has the frames."""
        del timeout_s
        return b""

    def write(self, data: bytes) -> None:
        """Send bytes on the link."""
        self.connection.write(data)

    def close(self) -> None:
        """Do nothing: the link is MAVProxy's."""

    def _read_through(self, *words: Any, **named: Any) -> Any:
        data = self._recv(*words, **named)
        if data:
            self._chunks.append((False, bytes(data)))
        return data

    def _write_through(self, data: Any, *words: Any, **named: Any) -> Any:
        self._chunks.append((True, bytes(data)))
        return self._write(data, *words, **named)


class Taps:
    """A tap for each of MAVProxy's links, including links added later."""

    def __init__(self) -> None:
        self._taps: list[Tap] = []

    def on(self, connections: Sequence[Any]) -> list[Tap]:
        """Return the taps of `connections`, all links at present; tap new links and release closed ones."""
        for tap in self._taps:
            if not any(tap.connection is connection for connection in connections):
                tap.remove()
        self._taps = [tap for tap in self._taps if any(tap.connection is c for c in connections)]
        known = [tap.connection for tap in self._taps]
        self._taps += [Tap(c) for c in connections if not any(c is k for k in known)]
        return self._taps

    @property
    def names(self) -> list[str]:
        """Names of the links."""
        return [tap.name for tap in self._taps]

    def named(self, name: str) -> Tap | None:
        """The tap of the link with that name."""
        return next((tap for tap in self._taps if tap.name == name), None)

    def remove(self) -> None:
        """Restore every link's own methods."""
        for tap in self._taps:
            tap.remove()
        self._taps = []
