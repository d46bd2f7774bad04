# SPDX-License-Identifier: GPL-3.0-or-later
"""MAVProxy's links listened in on: what each reads and what each writes, every byte, in order.

MAVProxy hands its modules neither what it sends, nor which link a message came on, nor the frames that it does not
know or holds for delayed; its links' own `recv` and `write` pass all of it.
"""

from collections import deque
from collections.abc import Sequence
from typing import Any, Final

from bridge.framing import Frame, Framer

PAUSE_S: Final = 0.5
MOST_WAITING: Final = 10_000
"""Chunks kept for who does not ask: half a minute of the busiest link."""


class Tap:
    """One link of MAVProxy, with what passed through it since the last call; a `Link` by its name alone."""

    def __init__(self, connection: Any) -> None:
        self.connection = connection
        self.name: str = str(getattr(connection, "address", "MAVProxy's link"))
        self._chunks: deque[tuple[bool, bytes]] = deque(maxlen=MOST_WAITING)
        self._framers = {False: Framer(), True: Framer()}
        self._last_s = 0.0
        self._recv, self._write = connection.recv, connection.write
        connection.recv, connection.write = self._read_through, self._write_through

    def remove(self) -> None:
        """Leave the link as it was."""
        for name, ours in (("recv", self._read_through), ("write", self._write_through)):
            # Whoever wrapped it after us keeps working through us.
            if getattr(self.connection, name) == ours:
                delattr(self.connection, name)

    def take(self, now_s: float) -> list[tuple[bool, Frame]]:
        """Frames since the last call in the order in which they passed; True for what was sent."""
        found = []
        if self._chunks:
            self._last_s = now_s
        elif now_s - self._last_s >= PAUSE_S:
            found += [(sent, frame) for sent, framer in self._framers.items() for frame in framer.flush()]
        while self._chunks:
            sent, data = self._chunks.popleft()
            found += [(sent, frame) for frame in self._framers[sent].feed(data)]
        return found

    def read(self, timeout_s: float) -> bytes:
        """Nothing: `take` has the frames."""
        del timeout_s
        return b""

    def write(self, data: bytes) -> None:
        """Send bytes on the link."""
        self.connection.write(data)

    def close(self) -> None:
        """The link is MAVProxy's."""

    def _read_through(self, *words: Any, **named: Any) -> Any:
        data = self._recv(*words, **named)
        if data:
            self._chunks.append((False, bytes(data)))
        return data

    def _write_through(self, data: Any, *words: Any, **named: Any) -> Any:
        self._chunks.append((True, bytes(data)))
        return self._write(data, *words, **named)


class Taps:
    """A tap for each of MAVProxy's links, also for those that are added later."""

    def __init__(self) -> None:
        self._taps: list[Tap] = []

    def on(self, connections: Sequence[Any]) -> list[Tap]:
        """The taps of `connections`, which are all links that there are now."""
        for tap in self._taps:
            if not any(tap.connection is connection for connection in connections):
                tap.remove()
        self._taps = [tap for tap in self._taps if any(tap.connection is c for c in connections)]
        known = [tap.connection for tap in self._taps]
        self._taps += [Tap(c) for c in connections if not any(c is k for k in known)]
        return self._taps

    @property
    def names(self) -> list[str]:
        """The names of the links."""
        return [tap.name for tap in self._taps]

    def named(self, name: str) -> Tap | None:
        """The tap of the link of that name."""
        return next((tap for tap in self._taps if tap.name == name), None)

    def remove(self) -> None:
        """Leave every link as it was."""
        for tap in self._taps:
            tap.remove()
        self._taps = []
