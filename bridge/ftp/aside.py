"""A file server beside the bridge's loop: the disk is read in a thread of its own, and the loop waits for nothing."""

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
    """`hear` and `due` of a `FileServer`, at once; its work is done in a thread. Answers are due by the next call."""

    def __init__(self, server: FileServer, clock: Clock) -> None:
        self._server, self._clock = server, clock
        self._heard: Queue[tuple[Peer, bytes]] = Queue(MOST_HEARD)
        self._answers: deque[tuple[Peer, bytes]] = deque()
        self._stop = Event()
        self._thread = Thread(target=self._run, name="file server", daemon=True)
        self._thread.start()

    def hear(self, peer: Peer, payload: bytes, now_s: float) -> None:
        """A packet came; one that finds no room is asked for again."""
        del now_s
        with suppress(Full):
            self._heard.put_nowait((peer, payload))

    def due(self, now_s: float) -> list[tuple[Peer, bytes]]:
        """What is ready to go out."""
        del now_s
        return [self._answers.popleft() for _ in range(len(self._answers))]

    def close(self) -> None:
        """End; a disk that stalls is not waited for long."""
        self._stop.set()
        self._thread.join(ENDING_S)

    def _run(self) -> None:
        while not self._stop.is_set():
            with suppress(Empty):
                self._server.hear(*self._heard.get(timeout=TICK_S), self._clock.boot_s())
                for _ in range(self._heard.qsize()):
                    self._server.hear(*self._heard.get_nowait(), self._clock.boot_s())
            # A loop that does not fetch its answers gets no more of them.
            if len(self._answers) < MOST_ANSWERS:
                self._answers.extend(self._server.due(self._clock.boot_s()))
