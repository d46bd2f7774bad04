"""Runs a file server outside the bridge's loop: a thread of its own reads the disk, and the loop never waits."""

from collections import deque
from contextlib import suppress
from queue import Empty, Full, Queue
from threading import Event, Thread
from typing import Final

from bridge.clock import Clock
from bridge.ftp.server import FileServer, Peer

TICK_S: Final = 0.02
MOST_HEARD: Final = 512
MOST_ANSWERS: Final = 512
ENDING_S: Final = 3.0


class ServedAside:
    """Offers `hear` and `due` of a `FileServer` that return at once; a thread does the work.

    Answers are ready at a later call of `due`.
    """

    def __init__(self, server: FileServer, clock: Clock) -> None:
        self._server, self._clock = server, clock
        self._heard: Queue[tuple[Peer, bytes]] = Queue(MOST_HEARD)
        self._answers: deque[tuple[Peer, bytes]] = deque()
        self._stop = Event()
        self._thread = Thread(target=self._run, name="file server", daemon=True)
        self._thread.start()

    def hear(self, peer: Peer, payload: bytes, now_s: float) -> None:
        """Queue a packet that arrived. A packet that finds no room is dropped, and asked for again."""
        del now_s
        with suppress(Full):
            self._heard.put_nowait((peer, payload))

    def due(self, now_s: float) -> list[tuple[Peer, bytes]]:
        """Return the answers that are ready to send."""
        del now_s
        return [self._answers.popleft() for _ in range(len(self._answers))]

    def close(self) -> None:
        """End the thread; a disk that stalls is not waited for long."""
        self._stop.set()
        self._thread.join(ENDING_S)

    def _run(self) -> None:
        while not self._stop.is_set():
            with suppress(Empty):
                self._server.hear(*self._heard.get(timeout=TICK_S), self._clock.boot_s())
                for _ in range(self._heard.qsize()):
                    self._server.hear(*self._heard.get_nowait(), self._clock.boot_s())
            # No more answers are made while the loop does not fetch them.
            if len(self._answers) < MOST_ANSWERS:
                self._answers.extend(self._server.due(self._clock.boot_s()))
