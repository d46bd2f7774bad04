"""The recorder: links to `.tlog`, each frame written unbuffered as it comes, from the first on.

A file that fails never ends the recording: the next one is opened, and what could not be written waits in
memory. Stamps run on the boot clock from one pairing with Unix time, so that a clock that is set mid-dive
can't turn them back. `go_on` ends one dive and begins the next between two frames, with links and outlet as they are.
What others on this computer send by way of the outlet goes out on every link, and into the file:
it explains later what was asked of the vehicle.
"""

import contextlib
import threading
from collections import deque
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Final, Protocol

from bridge.clock import Clock
from bridge.errors import LinkError, LogError
from bridge.framing import Encoder, Frame, Framer
from bridge.link.base import Link
from bridge.link.reconnecting import Aside
from gcs_plugin.link_health import LinkHealth
from gcs_plugin.station import ground_heartbeat

IDLE_FLUSH_S: Final = 0.5
SYNC_EVERY_S: Final = 1.0
CHECK_DISK_EVERY_S: Final = 2.0
WARN_DISK_S: Final = 600.0
LEAST_FREE_BYTES: Final = 1_000_000
MOST_WAITING_BYTES: Final = 16_000_000
RETRY_MAX_S: Final = 8.0
REOPEN_EVERY_S: Final = 1.0
HEARTBEAT_EVERY_S: Final = 1.0
WAIT_S: Final = 0.1
WAIT_FOR_CLIENTS_S: Final = 0.02
RATE_SHARE: Final = (
    0.1  # of the newest look at the disk, every 2 s, in the mean rate that the time left is told by
)


class Outlet(Protocol):
    """Who else gets the frames of a recording, and may send frames of its own; neither call waits or fails."""

    def broadcast(self, raw: bytes) -> None:
        """Take whole frames that came from the links."""
        ...

    def taken(self) -> list[bytes]:
        """The whole frames that are to be sent, since the last call."""
        ...


class Writer(Protocol):
    """What a recording is written to; every method but `close` raises LogError where it fails."""

    def write(self, unix_us: int, raw: bytes) -> None: ...

    def sync(self) -> None: ...

    def close(self) -> None: ...


@dataclass(frozen=True, slots=True)
class Notice:
    """Something that an operator must hear of: `level` is "info", "warning" or "error"."""

    unix_us: int
    level: str
    sentence: str


@dataclass(frozen=True, slots=True)
class Recorded:
    """A frame that is in a file, or waits for one: from which link, at what time it arrived."""

    unix_us: int
    link: str
    frame: Frame


@dataclass(frozen=True, slots=True)
class Count:
    """What a dive's files hold; `heard` are the frames of the links alone, `lost` those that no file took."""

    files: int
    heard: int
    frames: int
    bytes: int
    lost: int


@dataclass(frozen=True)
class _Following:
    """Where the next dive goes."""

    writer: Writer
    open_file: Callable[[int], Writer]
    changed: Callable[[Count], None]


@dataclass
class _Port:
    """A link with what belongs to it; `link` is None while it is gone, `again` opens it aside, where it may."""

    name: str
    link: Link | None
    framer: Framer
    health: LinkHealth
    last_data_s: float
    again: Callable[[], Link] | None = None
    retry_s: float = 0.0


def _nothing() -> None:
    """What is done each second where nobody asks for anything."""


class Recorder:
    """Reads `links`, writes what they say. `open_file(n)` makes the n-th file of the recording, from 1.

    `free_bytes` tells the space left where the files lie, or raises OSError; `notice` hears of trouble;
    `reopen` opens a lost link again by its name, in a thread of its own, so that the other links are not held
    up; `heartbeat` is (system, component) to beat as, None for a silent recorder; `each_second` is called in
    the thread that syncs the disk.
    """

    def __init__(
        self,
        links: Sequence[Link],
        open_file: Callable[[int], Writer],
        clock: Clock,
        free_bytes: Callable[[], int],
        notice: Callable[[Notice], None],
        reopen: Callable[[str], Link] | None = None,
        heartbeat: tuple[int, int] | None = None,
        outlet: Outlet | None = None,
        each_second: Callable[[], None] = _nothing,
    ) -> None:
        self._clock = clock
        self._boot_at_start_s = clock.boot_s()
        self._unix_at_start_s = clock.unix_s()
        self._open_file, self._free_bytes, self._notice = open_file, free_bytes, notice
        self._encoder = Encoder(*heartbeat) if heartbeat else None
        self._outlet, self._each_second = outlet, each_second
        self._wait_s = WAIT_FOR_CLIENTS_S if outlet else WAIT_S
        now_s = self._boot_at_start_s
        self._ports = [
            _Port(link.name, link, Framer(), LinkHealth(), now_s, _aside(reopen, link.name)) for link in links
        ]
        self._waiting: deque[tuple[int, bytes]] = deque()
        self._waiting_bytes = 0
        self._sync_failure = ""
        self._fresh = True
        self._retry_s, self._retry_delay_s = now_s, SYNC_EVERY_S
        self._next_disk_s = self._next_beat_s = now_s
        self._disk_checked_at_s, self._bytes_at_disk_check = now_s, 0
        self._disk_is_short = False
        self._mean_rate = 0.0
        self.disk_left_s = float("inf")
        self.heard = 0
        self.files = 0
        self.recorded = 0
        self.recorded_bytes = 0
        self.lost = 0
        self._following: _Following | None = None
        self._finished: deque[Writer] = deque()
        self._writer: Writer | None = self._open_first()

    @property
    def health(self) -> dict[str, LinkHealth]:
        """The health of each link by its name."""
        return {port.name: port.health for port in self._ports}

    @property
    def count(self) -> Count:
        """What the present dive's files hold."""
        return Count(self.files, self.heard, self.recorded, self.recorded_bytes, self.lost)

    def unix_us(self) -> int:
        """Now, on the recording's own clock, which never runs back."""
        return round((self._unix_at_start_s + self._clock.boot_s() - self._boot_at_start_s) * 1e6)

    def step(self, timeout_s: float) -> list[Recorded]:
        """Record what the links have, waiting up to `timeout_s` where they have nothing."""
        self._change()
        taken = [item for port in self._ports for item in self._read(port, 0.0)]
        alive = [port for port in self._ports if port.link is not None]
        if not taken and timeout_s > 0:
            for port in alive:
                taken += self._read(port, timeout_s / len(alive))
        self._beat()
        self._serve(taken)
        self._drain()
        self._check_disk()
        return taken

    def go_on(self, open_file: Callable[[int], Writer], changed: Callable[[Count], None]) -> None:
        """Begin the next dive with the next `step`, in files of `open_file`; may be called from another thread.

        `changed` hears in the thread of `step` what the files before hold. Raises LogError where the first file can't
        be made, or a next dive waits already: all stays as it is.
        """
        if self._following is not None:
            raise LogError("the next dive waits for the disk already; check the disk")
        self._following = _Following(open_file(1), open_file, changed)

    def sync(self) -> None:
        """Put what is written on the disk; to be called from another thread than `step`."""
        while self._finished:
            self._finish(self._finished.popleft())
        writer = self._writer
        if writer is None:
            return
        try:
            writer.sync()
        except LogError as error:
            if writer is self._writer:
                self._sync_failure = str(error)

    def close(self) -> None:
        """Write what waits and close files and links."""
        self._change()
        for port in self._ports:
            for frame in port.framer.flush():
                self._keep(port, frame)
        self._retry_s = self._clock.boot_s()
        self._drain()
        if self._waiting:
            self._say("error", f"{len(self._waiting)} frames could not be written and are lost")
            self.lost += len(self._waiting)
        self.sync()
        if self._writer is not None:
            with contextlib.suppress(OSError):
                self._writer.close()
            self._writer = None
        for port in self._ports:
            if port.link is not None:
                port.link.close()

    def run(self, stop: threading.Event) -> None:
        """Record until `stop` is set, then close; once a second the disk is synced in another thread."""
        syncer = threading.Thread(target=self._sync_until, args=(stop,), name="recorder-sync", daemon=True)
        syncer.start()
        try:
            while not stop.is_set():
                idle = not any(port.link for port in self._ports)
                self.step(self._wait_s)
                if idle:
                    stop.wait(self._wait_s)
        finally:
            stop.set()
            syncer.join()
            self.close()

    def _sync_until(self, stop: threading.Event) -> None:
        while not stop.wait(SYNC_EVERY_S):
            # Before the disk is asked for anything: one that stalls would make a recording that runs look dead.
            self._each_second()
            self.sync()

    def _change(self) -> None:
        """Go on in the next dive's files where one is to begin; what could not be written yet goes there."""
        following, self._following = self._following, None
        if following is None:
            return
        self._drain()
        if self._writer is not None:
            # Closed by who syncs: waiting for the disk here would lose what the links bring meanwhile.
            self._finished.append(self._writer)
        self._writer, self._open_file = following.writer, following.open_file
        self._fresh, self._retry_s, self._retry_delay_s = True, self._clock.boot_s(), SYNC_EVERY_S
        count = self.count
        self._bytes_at_disk_check -= count.bytes
        self.files, self.heard, self.recorded, self.recorded_bytes, self.lost = 1, 0, 0, 0, 0
        following.changed(count)

    def _finish(self, writer: Writer) -> None:
        """Put a finished dive's file on the disk, and close it."""
        try:
            writer.sync()
        except LogError as error:
            self._say("error", str(error))
        with contextlib.suppress(OSError):
            writer.close()

    def _read(self, port: _Port, timeout_s: float) -> list[Recorded]:
        link = port.link or self._reopened(port)
        if link is None:
            return []
        try:
            data = link.read(timeout_s)
        except LinkError as error:
            self._lose(port, error)
            return []
        now_s = self._clock.boot_s()
        if data:
            port.last_data_s = now_s
            frames = port.framer.feed(data)
        elif now_s - port.last_data_s >= IDLE_FLUSH_S:
            frames = port.framer.flush()
        else:
            return []
        return [self._keep(port, frame) for frame in frames]

    def _keep(self, port: _Port, frame: Frame) -> Recorded:
        port.health.on_frame(frame, self._clock.boot_s())
        self.heard += 1
        return Recorded(self._store(frame.raw), port.name, frame)

    def _store(self, raw: bytes) -> int:
        """Put a frame into the file; its stamp."""
        stamp_us = self.unix_us()
        self._waiting.append((stamp_us, raw))
        self._waiting_bytes += len(raw)
        self._drain()
        return stamp_us

    def _serve(self, taken: Sequence[Recorded]) -> None:
        """Hand the outlet what came; send and keep what it has, in this order, since no order waits for a disk."""
        if self._outlet is None:
            return
        if taken:
            self._outlet.broadcast(b"".join(item.frame.raw for item in taken))
        for raw in self._outlet.taken():
            self._send(raw)
            self._store(raw)

    def _drain(self) -> None:
        if self._sync_failure:
            self._fail(self._sync_failure)
            self._sync_failure = ""
        while self._waiting:
            if self._writer is None and not self._may_open():
                break
            stamp_us, raw = self._waiting[0]
            try:
                if self._writer is None:
                    self._open_next()
                if self._writer is None:
                    break
                self._writer.write(stamp_us, raw)
            except LogError as error:
                self._fail(str(error))
                continue
            self._waiting.popleft()
            self._waiting_bytes -= len(raw)
            self._fresh, self._retry_delay_s = False, SYNC_EVERY_S
            self.recorded += 1
            self.recorded_bytes += len(raw)
        while self._waiting_bytes > MOST_WAITING_BYTES:
            self._waiting_bytes -= len(self._waiting.popleft()[1])
            self.lost += 1

    def _may_open(self) -> bool:
        return self._clock.boot_s() >= self._retry_s and self._space() >= LEAST_FREE_BYTES

    def _space(self) -> int:
        """Bytes left for files; none on a disk that is not there."""
        try:
            return self._free_bytes()
        except OSError:
            return 0

    def _open_first(self) -> Writer:
        self.files = 1
        return self._open_file(1)

    def _open_next(self) -> None:
        self.files += 1
        try:
            self._writer = self._open_file(self.files)
            self._fresh = True
        except LogError as error:
            self._say("error", str(error))
            self._delay()
            return
        self._say("warning", f"the recording goes on in its file {self.files}")

    def _fail(self, sentence: str) -> None:
        self._say("error", sentence)
        if self._writer is not None:
            # The file is given up; what its close has to say changes nothing.
            with contextlib.suppress(OSError):
                self._writer.close()
            self._writer = None
        if self._fresh:
            self._delay()
        else:
            self._retry_s = self._clock.boot_s()

    def _delay(self) -> None:
        self._retry_s = self._clock.boot_s() + self._retry_delay_s
        self._retry_delay_s = min(2 * self._retry_delay_s, RETRY_MAX_S)

    def _lose(self, port: _Port, error: LinkError) -> None:
        self._say("error", str(error))
        if port.link is not None:
            port.link.close()
        port.link, port.framer = None, Framer()
        port.retry_s = self._clock.boot_s() + REOPEN_EVERY_S

    def _reopened(self, port: _Port) -> Link | None:
        if port.again is None or self._clock.boot_s() < port.retry_s:
            return None
        port.retry_s = self._clock.boot_s() + REOPEN_EVERY_S
        try:
            port.link = port.again()
        except LinkError:
            return None
        self._say("info", f"{port.name} is back")
        return port.link

    def _beat(self) -> None:
        if self._encoder is None or self._clock.boot_s() < self._next_beat_s:
            return
        self._next_beat_s = self._clock.boot_s() + HEARTBEAT_EVERY_S
        self._send(self._encoder.encode(ground_heartbeat()))

    def _send(self, raw: bytes) -> None:
        for port in self._ports:
            if port.link is not None:
                try:
                    port.link.write(raw)
                except LinkError as error:
                    self._lose(port, error)

    def _check_disk(self) -> None:
        now_s = self._clock.boot_s()
        if now_s < self._next_disk_s:
            return
        self._next_disk_s = now_s + CHECK_DISK_EVERY_S
        span_s = now_s - self._disk_checked_at_s
        if span_s <= 0:
            return
        rate = (self.recorded_bytes - self._bytes_at_disk_check) / span_s
        self._disk_checked_at_s, self._bytes_at_disk_check = now_s, self.recorded_bytes
        free = self._space()
        left_s = free / rate if rate > 0 else float("inf")
        self._mean_rate += RATE_SHARE * (rate - self._mean_rate) if self._mean_rate > 0 else rate
        self.disk_left_s = free / self._mean_rate if rate > 0 else float("inf")
        short = left_s < WARN_DISK_S or free < LEAST_FREE_BYTES
        if short and not self._disk_is_short:
            minutes = f"about {left_s / 60:.0f} min of recording" if rate > 0 else "next to nothing"
            self._say("warning", f"the disk has {free / 1e6:.1f} MB left, {minutes}; free some space")
        self._disk_is_short = short

    def _say(self, level: str, sentence: str) -> None:
        self._notice(Notice(self.unix_us(), level, sentence))


def _aside(reopen: Callable[[str], Link] | None, name: str) -> Callable[[], Link] | None:
    return None if reopen is None else Aside(lambda: reopen(name), name)
