"""A link that comes back after a port was unplugged or a peer was restarted."""

from collections.abc import Callable
from queue import Empty, SimpleQueue
from threading import Event, Thread

from bridge.clock import Clock
from bridge.errors import LinkError
from bridge.links.link import Link

FIRST_RETRY_S = 0.25
SLOWEST_RETRY_S = 1.0
PATIENCE_S = 0.01  # enough for a port of this computer


def next_retry_s(retry_s: float) -> float:
    """Return the time to wait after one more failure."""
    return min(2 * retry_s, SLOWEST_RETRY_S)


def ignore_loss(_: str) -> None:
    """Ignore a loss: the listener if none was given."""


class Reconnecting(Link):
    """Opens its link by `factory`, again and again with back-off; reads and writes raise no LinkError.

    `fault` is the sentence of the last failure while the link is away, "" while it works, and `reason` the same without
    the link's name. Data written meanwhile is lost, and each such write is counted in `dropped`. `lost` is called with
    the reason when a working link is lost, once for each sentence.
    """

    def __init__(
        self,
        factory: Callable[[], Link],
        clock: Clock,
        name: str = "link",
        lost: Callable[[str], None] = ignore_loss,
    ) -> None:
        self.name = name
        self.reason = ""
        self._factory = factory
        self._clock = clock
        self._lost, self._reported = lost, set[str]()
        self._link: Link | None = None
        self._lost_before = 0
        self._retry_s = FIRST_RETRY_S
        self._due_s = clock.boot_s()
        self._closed = Event()

    @property
    def lost_writes(self) -> int:
        return self.dropped + self._lost_before + (self._link.lost_writes if self._link is not None else 0)

    def read(self, timeout_s: float) -> bytes:
        link = self._opened()
        if link is None:
            self._closed.wait(max(0.0, timeout_s))
            return b""
        try:
            return link.read(timeout_s)
        except LinkError as error:
            self._lose(link, error)
            return b""

    def write(self, data: bytes) -> None:
        link = self._opened()
        if link is None:
            self.dropped += 1
            return
        try:
            link.write(data)
        except LinkError as error:
            self.dropped += 1
            self._lose(link, error)

    def close(self) -> None:
        self._closed.set()
        if self._link is not None:
            self._link.close()
            self._link = None

    def _opened(self) -> Link | None:
        if self._link is None and not self._closed.is_set() and self._clock.boot_s() >= self._due_s:
            try:
                self._link = self._factory()
            except LinkError as error:
                self._wait_after(error)
            else:
                self.name, self._retry_s = self._link.name, FIRST_RETRY_S
                self.fault = self.reason = ""
        return self._link

    def _lose(self, link: Link, error: LinkError) -> None:
        self._lost_before += link.lost_writes
        link.close()
        self._link = None
        if str(error) not in self._reported:
            self._reported.add(str(error))
            self._lost(str(error))
        self._wait_after(error)

    def _wait_after(self, error: LinkError) -> None:
        self.fault, self.reason = str(error), error.reason
        self._due_s = self._clock.boot_s() + self._retry_s
        self._retry_s = next_retry_s(self._retry_s)


class Aside:
    """A factory that opens its links in a thread, for a caller that must not wait for a network.

    A call returns the link that has been opened since. While there is none, it raises LinkError within `PATIENCE_S`,
    with the reason of the last failure. One reader only.
    """

    def __init__(self, factory: Callable[[], Link], name: str) -> None:
        self._factory = factory
        self._last = LinkError("is being opened; wait", name)
        self._name = name
        self._answers: SimpleQueue[Link | LinkError] = SimpleQueue()
        self._busy = False

    def __call__(self) -> Link:
        if not self._busy:
            self._busy = True
            Thread(target=self._open, name="open a link", daemon=True).start()
        try:
            answer = self._answers.get(timeout=PATIENCE_S)
        except Empty:
            raise LinkError(self._last.reason, self._last.of) from None
        self._busy = False
        if isinstance(answer, LinkError):
            self._last = answer
            raise answer
        return answer

    def _open(self) -> None:
        try:
            self._answers.put(self._factory())
        except LinkError as error:
            self._answers.put(error)
        except Exception as error:  # noqa: BLE001 (without an answer the link would be opened for ever)
            self._answers.put(
                LinkError(f"can't be opened ({error}); check the link and its name", self._name)
            )
