"""The one bad link: it disturbs frames one by one, with switches to flip while it runs."""

import random
from collections.abc import Callable
from dataclasses import dataclass
from operator import itemgetter

from bridge.clock import Clock
from bridge.links.link import Link, Wrapper
from bridge.wire.framing import Frame, Framer

OVERTAKEN_S = 0.2


@dataclass
class Faults:
    """Probabilities of the faults of each frame, and its delay, to which up to `jitter_s` is drawn for each; `cut` lets
    no frame through."""

    loss: float = 0.0
    duplicate: float = 0.0
    reorder: float = 0.0
    corrupt: float = 0.0
    delay_s: float = 0.0
    jitter_s: float = 0.0
    cut: bool = False


class Lossy(Wrapper):
    """Wraps a link. Written frames suffer the faults `outgoing`, read frames `incoming`; both start as given.

    `each` is called with each frame, either way, before it is carried.
    """

    def __init__(self, link: Link, rng: random.Random, clock: Clock, **faults: float) -> None:
        super().__init__(link)
        self.name = f"lossy {link.name}"
        self.outgoing, self.incoming = Faults(**faults), Faults(**faults)
        self.each: Callable[[Frame], None] = lambda _: None
        self._clock = clock
        self._out = _Way(self, self.outgoing, rng)
        self._in = _Way(self, self.incoming, rng)

    @property
    def faults(self) -> tuple[Faults, Faults]:
        return self.outgoing, self.incoming

    def read(self, timeout_s: float) -> bytes:
        self._send_due()
        self._in.take(self._link.read(timeout_s), self._clock.boot_s())
        return b"".join(self._in.due(self._clock.boot_s()))

    def write(self, data: bytes) -> None:
        self._out.take(data, self._clock.boot_s())
        self._send_due()

    def _send_due(self) -> None:
        for raw in self._out.due(self._clock.boot_s()):
            self._link.write(raw)


class _Way:
    """One direction: frames in the order in which they come out, each with its time."""

    def __init__(self, link: Lossy, faults: Faults, rng: random.Random) -> None:
        self._link, self._faults = link, faults
        self._rng = rng
        self._framer = Framer()
        self._queue: list[tuple[float, bytes]] = []
        self._overtaken: list[tuple[float, bytes]] = []

    def take(self, data: bytes, now_s: float) -> None:
        for frame in self._framer.feed(data):
            self._link.each(frame)
            faults = self._faults
            if faults.cut or self._rng.random() < faults.loss:
                continue
            copies = 2 if self._rng.random() < faults.duplicate else 1
            for _ in range(copies):
                jitter_s = self._rng.uniform(0.0, faults.jitter_s) if faults.jitter_s else 0.0
                self._queue_one(frame.raw, now_s + faults.delay_s + jitter_s)

    def due(self, now_s: float) -> list[bytes]:
        if not (self._queue or self._overtaken):
            return []
        overdue = [entry for entry in self._overtaken if entry[0] + OVERTAKEN_S <= now_s]
        self._overtaken = [entry for entry in self._overtaken if entry not in overdue]
        self._queue += overdue
        if self._faults.jitter_s:
            self._queue.sort(key=itemgetter(0))
        out = [raw for due_s, raw in self._queue if due_s <= now_s]
        self._queue = [entry for entry in self._queue if entry[0] > now_s]
        return out

    def _queue_one(self, raw: bytes, due_s: float) -> None:
        if self._rng.random() < self._faults.corrupt:
            place = self._rng.randrange(len(raw))
            raw = raw[:place] + bytes((raw[place] ^ 1 << self._rng.randrange(8),)) + raw[place + 1 :]
        if self._rng.random() < self._faults.reorder:
            self._overtaken.append((due_s, raw))
            return
        self._queue.append((due_s, raw))
        self._queue += [(due_s, late) for _, late in self._overtaken]
        self._overtaken = []
