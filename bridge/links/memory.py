"""Two link ends in one process, each of which reads the bytes that the other writes; for lock-step."""

from collections import deque
from threading import Condition

from bridge.errors import LinkLost
from bridge.links.link import Link


class MemoryLink(Link):
    """One end of `memory_pair`. Chunks are handed over as they were written, without a copy."""

    def __init__(self, name: str, inbox: deque[bytes], outbox: deque[bytes], changed: Condition) -> None:
        self.name = name
        self._inbox = inbox
        self._outbox = outbox
        self._changed = changed
        self._open = True
        self._peer: MemoryLink | None = None

    def join(self, peer: "MemoryLink") -> None:
        """Set the other end, so that its closing is noticed."""
        self._peer = peer

    def read(self, timeout_s: float) -> bytes:
        if not self._inbox:
            if timeout_s > 0 and self._alive():
                with self._changed:
                    self._changed.wait_for(lambda: bool(self._inbox) or not self._alive(), timeout_s)
            if not self._inbox:
                if not self._alive():
                    raise LinkLost("the other end was closed; open a new pair", self.name)
                return b""
        return self._inbox.popleft()

    def write(self, data: bytes) -> None:
        if not self._alive():
            raise LinkLost("the other end was closed; open a new pair", self.name)
        self._outbox.append(data)
        with self._changed:
            self._changed.notify_all()

    def close(self) -> None:
        self._open = False
        with self._changed:
            self._changed.notify_all()

    def _alive(self) -> bool:
        return self._open and (self._peer is None or self._peer._open)


def memory_pair() -> tuple[MemoryLink, MemoryLink]:
    """Return two ends that are joined to each other."""
    there: deque[bytes] = deque()
    back: deque[bytes] = deque()
    changed = Condition()
    a = MemoryLink("memory:a", back, there, changed)
    b = MemoryLink("memory:b", there, back, changed)
    a.join(b)
    b.join(a)
    return a, b
