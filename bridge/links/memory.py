"""Two link ends in one process, each of which reads the bytes that the other writes; for lock-step."""

from collections import deque
from threading import Condition
from typing import Final

from bridge.errors import LinkLost
from bridge.links.link import Link


class _Cable:
    """What both ends share: whether it holds, and the notice of any change."""

    def __init__(self) -> None:
        self.whole = True
        self.changed: Final = Condition()


class MemoryLink(Link):
    """One end of `memory_pair`. Chunks are handed over as they were written, without a copy."""

    def __init__(self, name: str, inbox: deque[bytes], outbox: deque[bytes], cable: _Cable) -> None:
        self.name = name
        self._inbox = inbox
        self._outbox = outbox
        self._cable = cable

    def read(self, timeout_s: float) -> bytes:
        cable = self._cable
        if not self._inbox and timeout_s > 0:
            with cable.changed:
                cable.changed.wait_for(lambda: bool(self._inbox) or not cable.whole, timeout_s)
        if self._inbox:
            return self._inbox.popleft()
        self._check_whole()
        return b""

    def write(self, data: bytes) -> None:
        self._check_whole()
        self._outbox.append(data)
        with self._cable.changed:
            self._cable.changed.notify_all()

    def close(self) -> None:
        self._cable.whole = False
        with self._cable.changed:
            self._cable.changed.notify_all()

    def _check_whole(self) -> None:
        if not self._cable.whole:
            raise LinkLost("the other end was closed; open a new pair", self.name)


def memory_pair() -> tuple[MemoryLink, MemoryLink]:
    """Return two ends that are joined to each other."""
    there, back = deque[bytes](), deque[bytes]()
    cable = _Cable()
    return MemoryLink("memory:a", back, there, cable), MemoryLink("memory:b", there, back, cable)
